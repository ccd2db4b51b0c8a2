#include <hpsdf/field_file.h>

#include <cstdio>
#include <filesystem>

#include "torus_field.h"

int main() {
  const hpsdf::Field field = torusField();
  const auto [value, gradient] = field.valueAndGradient({1.05, 0, 0});  // 0.05 outside, straight away from the ring
  if (std::abs(value - 0.05) > 1e-2 || (gradient - hpsdf::Vector3::UnitX()).norm() > 0.1) {
    std::fprintf(stderr, "value %g, gradient %g %g %g\n", value, gradient.x(), gradient.y(), gradient.z());
    return 1;
  }
  // a file pulls in what core links privately
  hpsdf::save(field, "torus.hpsdf");
  const bool same = hpsdf::load("torus.hpsdf").value({1.05, 0, 0}) == value;
  std::filesystem::remove("torus.hpsdf");
  return same ? 0 : 1;
}
