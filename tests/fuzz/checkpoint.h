#pragma once
// The constructions that the fuzz target `checkpoint` resumes. The target's corpus contains their states.

#include <array>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"

namespace hpsdf::fuzz {

/// Returns constructions that end soon from any state, because they have few cells to refine. The last one makes exact
/// leaves.
inline std::array<BuildOptions, 4> constructions() {
  BuildOptions paper{.targetError = 1e-3, .grid = {2, 1, 1}, .maxDegree = 2, .maxDepth = 2, .threads = 1};
  BuildOptions optimal = paper;
  optimal.criterion = Criterion::optimal;
  BuildOptions byDistance = paper;
  byDistance.targetError = NearFarError{3e-2, 1e-1};
  byDistance.maxError = 0.1;
  BuildOptions exact = paper;
  exact.strategy = Strategy::hpx;
  exact.exactTriangles = 4;
  return {paper, optimal, byDistance, exact};
}

inline double sphere(const Vector3& x) { return (x - Vector3(0.1, 0.2, 0)).norm() - 0.5; }
/// Returns an octahedron, whose distance is exact in some leaves.
inline TriangleMesh octahedron() {
  TriangleMesh mesh;
  mesh.name = "octahedron.obj";
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-0.5, 0.5}) mesh.vertices.emplace_back(side * Vector3::Unit(axis) + Vector3(0.1, 0.2, 0));
  for (std::uint32_t octant = 0; octant < 8; ++octant) {
    const std::uint32_t x = octant & 1, y = 2 + (octant >> 1 & 1), z = 4 + (octant >> 2);
    const bool turns = std::popcount(octant) % 2 == 0;
    mesh.triangles.push_back({x, turns ? z : y, turns ? y : z});
  }
  return mesh;
}

/// Returns the distance of the construction with this index.
inline DistanceFunction distanceOf(std::size_t construction) {
  if (construction < 3) return DistanceFunction(sphere);
  static const ExactDistance exact(octahedron(), {.insideTest = InsideTest::pseudonormal, .threads = 1});
  return DistanceFunction(exact);
}

inline Box domain() { return Box(Vector3::Constant(-1), Vector3::Constant(1)); }

/// Returns the number of bytes before the state in a checkpoint: magic number, versions and three digests.
inline std::size_t bytesBeforeState(std::string_view checkpoint) {
  constexpr std::size_t kLengthAt = 8 + 4;  // position of the length of the program's version text
  std::uint32_t length = 0;
  checkpoint.copy(reinterpret_cast<char*>(&length), sizeof length, kLengthAt);
  return kLengthAt + sizeof length + length + 3 * 8;
}

}  // namespace hpsdf::fuzz
