// OpenVDB's narrow-band level set of the bunny: 256 voxels along the mesh's longest side, and three voxels on each side
// of the surface.

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>

#include "contour_scene.h"
#include "scene.h"

namespace hpsdf::bench {
namespace {

constexpr std::size_t kPoints = 1'000'000;
constexpr double kVoxel = 2.0 / 256;
constexpr float kHalfWidth = 3;

/// A mesh in OpenVDB's types.
struct VdbMesh {
  explicit VdbMesh(const TriangleMesh& mesh) {
    for (const Vector3& v : mesh.vertices) points.emplace_back(float(v.x()), float(v.y()), float(v.z()));
    for (const auto& [a, b, c] : mesh.triangles) triangles.emplace_back(a, b, c);
  }

  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
};

openvdb::FloatGrid::Ptr levelSet(const VdbMesh& mesh) {
  const auto transform = openvdb::math::Transform::createLinearTransform(kVoxel);
  return openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, mesh.points, mesh.triangles, kHalfWidth);
}

const openvdb::FloatGrid& bunnyLevelSet() {
  static const openvdb::FloatGrid::Ptr grid = [] {
    openvdb::initialize();
    return levelSet(VdbMesh(bunny()));
  }();
  return *grid;
}

/// Interpolates trilinearly at every point; the accessor caches the path to the last leaf.
void sample(const openvdb::FloatGrid& grid, const std::vector<Vector3>& points, std::vector<double>& out) {
  using Accessor = openvdb::FloatGrid::ConstAccessor;
  const Accessor accessor = grid.getConstAccessor();
  const openvdb::tools::GridSampler<Accessor, openvdb::tools::BoxSampler> sampler(accessor, grid.transform());
  for (std::size_t i = 0; i < points.size(); ++i)
    out[i] = sampler.wsSample(openvdb::Vec3d(points[i].x(), points[i].y(), points[i].z()));
}

void bunnyValue(benchmark::State& state) {
  const openvdb::FloatGrid& grid = bunnyLevelSet();
  const std::vector<Vector3> points = uniformPoints(kPoints);
  std::vector<double> out(kPoints);
  timeEach(state, kPoints, [&] { sample(grid, points, out); });
}

void nearSurface(benchmark::State& state) {
  openvdb::initialize();
  const VdbMesh mesh(bunny());
  openvdb::FloatGrid::Ptr grid;
  for ([[maybe_unused]] auto _ : state) grid = levelSet(mesh);
  const std::vector<Vector3> points = nearPoints(200'000, 0.02);
  std::vector<double> values(points.size());
  sample(*grid, points, values);
  state.counters["bytes"] = double(grid->memUsage());
  state.counters["rms"] = rmsError(points, values);
}

/// The mesh of the level set. The adaptivity is that at which the mesh has fewest triangles before its Hausdorff
/// distance grows.
void contourOfBunny(benchmark::State& state) {
  constexpr double kAdaptivity = 0.1;
  const openvdb::FloatGrid& grid = bunnyLevelSet();
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  for ([[maybe_unused]] auto _ : state) openvdb::tools::volumeToMesh(grid, points, triangles, quads, 0.0, kAdaptivity);
  TriangleMesh mesh{.vertices = {}, .triangles = {}, .name = "OpenVDB"};
  for (const openvdb::Vec3s& x : points) mesh.vertices.emplace_back(x.x(), x.y(), x.z());
  for (const openvdb::Vec3I& t : triangles) mesh.triangles.push_back({t[0], t[1], t[2]});
  for (const openvdb::Vec4I& q : quads) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  }
  countMesh(state, mesh);
}

BENCHMARK(contourOfBunny)->Name("contour/openvdb")->MeasureProcessCPUTime()->UseRealTime()->Iterations(1);
BENCHMARK(bunnyValue)->Name("query/bunny/openvdb");
BENCHMARK(nearSurface)->Name("near/openvdb")->MeasureProcessCPUTime()->UseRealTime()->Iterations(1);

}  // namespace
}  // namespace hpsdf::bench
