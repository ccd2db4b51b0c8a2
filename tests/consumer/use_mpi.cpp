#include <hpsdf/build.h>
#include <hpsdf/mpi.h>
#include <hpsdf/shapes.h>

#include <cstdio>
#include <memory>
#include <optional>

// A field that all processes of an MPI program build, of which there is one here, equals that of `build`.
int main() {
  const hpsdf::mpi::Session session;
  const hpsdf::DistanceFunction torus = hpsdf::shapes::analytic("torus");
  const hpsdf::Box domain(hpsdf::Vector3(-2, -2, -2), hpsdf::Vector3(2, 2, 2));
  const std::unique_ptr<hpsdf::Ranks> ranks = hpsdf::mpi::allRanks();
  const std::optional<hpsdf::Field> field = hpsdf::buildByRanks(*ranks, torus, domain, {.targetError = 1e-5});
  const hpsdf::Field alone = hpsdf::build(torus, domain, {.targetError = 1e-5});
  const hpsdf::Vector3 x(0.9, 0.1, 0.2);
  if (field && field->value(x) == alone.value(x)) return 0;
  std::fprintf(stderr, "the field by MPI differs from that of one process\n");
  return 1;
}
