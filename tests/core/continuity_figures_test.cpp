// Tests jumps, errors and sizes of weakly continuous fields of a scanned mesh.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/jumps.h"
#include "hpsdf/mesh_file.h"
#include "support/test_mesh.h"

namespace hpsdf {
namespace continuity_figures_test {

struct Figures {
  double jump, rms, bytes;
};

class Meter {
 public:
  Meter(const ExactDistance& distance, const Box& domain) : points_(100000), exact_(points_.size()) {
    std::mt19937_64 random(2017);
    std::uniform_real_distribution<double> unit(0, 1);
    for (Vector3& x : points_)
      for (int axis = 0; axis < 3; ++axis) x[axis] = domain.min()[axis] + unit(random) * domain.sizes()[axis];
    distance(points_, exact_);
  }

  Figures operator()(const Field& field) const {
    std::vector<double> values(points_.size());
    field.values(points_, values);
    double squares = 0;
    for (std::size_t i = 0; i < values.size(); ++i) squares += (values[i] - exact_[i]) * (values[i] - exact_[i]);
    return {findJumps(field).value.rms, std::sqrt(squares / double(values.size())), double(field.bytes())};
  }

 private:
  std::vector<Vector3> points_;
  std::vector<double> exact_;
};

TEST(ContinuityFigures, bunny) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const TriangleMesh mesh = importMesh(support::testMesh("paper/bunny_69k.obj")).mesh;
  const ExactDistance distance(mesh);
  const Box domain = domainAround(mesh);
  const Meter meter(distance, domain);
  BuildOptions options{.targetError = 1e-5, .estimator = Estimator::embedded, .strategy = Strategy::hp};
  const Field discontinuous = build(distance, domain, options);
  const Figures before = meter(discontinuous);

  const WeaklyContinuous smoothed = weaklyContinuous(discontinuous);
  const Figures after = meter(smoothed.field);
  EXPECT_LT(after.jump, 0.5 * before.jump);
  EXPECT_LT(after.rms, 1.3 * before.rms);
  EXPECT_LT(after.bytes, 1.4 * before.bytes) << "the coefficients take two or three bits more";
  EXPECT_NEAR(after.rms, std::hypot(before.rms, smoothed.change), 0.02 * after.rms) << "f₀ is a projection";

  options.enrich = true;
  options.continuityWeight = 0.4;
  const Figures enriched = meter(build(distance, domain, options));
  EXPECT_LT(enriched.jump, 0.12 * before.jump);
  EXPECT_LT(enriched.rms, 1.02 * before.rms);
  EXPECT_LT(enriched.bytes, 2.1 * before.bytes);
}

}  // namespace continuity_figures_test
}  // namespace hpsdf
