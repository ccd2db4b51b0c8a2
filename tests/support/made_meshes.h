#pragma once
// Meshes made from other meshes, and random points in and around a box.

#include <algorithm>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "hpsdf/shapes.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::support {

inline TriangleMesh moved(TriangleMesh mesh, const Vector3& by, double scale = 1) {
  for (Vector3& x : mesh.vertices) x = scale * x + by;
  return mesh;
}

inline TriangleMesh joined(TriangleMesh one, const TriangleMesh& other) {
  const auto first = static_cast<std::uint32_t>(one.vertices.size());
  one.vertices.insert(one.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& [a, b, c] : other.triangles) one.triangles.push_back({first + a, first + b, first + c});
  return one;
}

inline TriangleMesh reversed(TriangleMesh mesh) {
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

/// Removes the triangles whose corners are all above this z.
inline TriangleMesh openAbove(TriangleMesh mesh, double z) {
  std::erase_if(mesh.triangles, [&](const auto& triangle) {
    return std::ranges::all_of(triangle, [&](std::uint32_t v) { return mesh.vertices[v].z() > z; });
  });
  return mesh;
}

/// Returns a box with edge length 2, centered at the origin.
inline TriangleMesh boxOfTwo() { return shapes::mesh("box,width=2,height=2,depth=2"); }

inline TriangleMesh boxBetween(const Vector3& low, const Vector3& high) {
  TriangleMesh mesh = boxOfTwo();
  for (Vector3& x : mesh.vertices) x = (low + high) / 2 + x.cwiseProduct(high - low) / 2;
  return mesh;
}

/// Returns a box with edge length 2, centered at the origin, without its upper side.
inline TriangleMesh openBox() { return openAbove(boxOfTwo(), 0.999); }

/// Returns random points in a box and slightly around it.
inline std::vector<Vector3> placesIn(const Box& box, int count, std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(-0.1, 1.1);
  std::vector<Vector3> places(static_cast<std::size_t>(count));
  for (Vector3& x : places) {
    const double a = u(random), b = u(random), c = u(random);
    x = box.min() + box.sizes().cwiseProduct(Vector3(a, b, c));
  }
  return places;
}

}  // namespace hpsdf::support
