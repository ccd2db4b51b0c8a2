#include <hpsdf/hpsdf.h>
using namespace hpsdf;

int main() {
  const TriangleMesh mesh = loadMesh("builtin:torus");  // or a file: part.obj, .ply, .stl, …
  const ExactDistance distance(mesh);                   // or any callable: double(const Vector3&)
  const Field field = build(distance, domainAround(mesh), {.targetError = 1e-6});
  const auto [value, gradient] = field.valueAndGradient({1.05, 0, 0});  // thread-safe, defined everywhere
  save(field, "torus.hpsdf");                                           // load("torus.hpsdf") reads it again
  return std::abs(value - 0.05) < 0.01 && gradient.x() > 0.9 ? 0 : 1;   // 0.05 outside the torus
}
