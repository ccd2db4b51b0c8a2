#include <hpsdf/openvdb/level_set.h>
#include <hpsdf/openvdb/read_level_set.h>

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "torus_field.h"

// A level set of a torus is written and read again: its distances must be those of the field.
int main() {
  const hpsdf::Field field = torusField();
  hpsdf::OutputFile out("torus.vdb");
  const auto figures = hpsdf::vdb::writeVdb(field, {.voxel = 0.02}, out);
  out.commit();
  const hpsdf::DistanceFunction distance(hpsdf::vdb::loadVdb("torus.vdb"));
  std::filesystem::remove("torus.vdb");

  const hpsdf::Vector3 x(kMajorRadius + kMinorRadius, 0.01, 0.02);
  double value = 0;
  distance({&x, 1}, {&value, 1});
  if (figures.activeVoxels > 1000 && std::abs(value - field.value(x)) < 0.002) return 0;
  std::fprintf(stderr, "the level set of %zu voxels has the distance %g rather than %g\n", figures.activeVoxels, value,
               field.value(x));
  return 1;
}
