#include "field/build/automatic_strategy.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "mesh/connectivity.h"

namespace hpsdf::detail {
namespace {

/// Total lengths of the edges between two triangles whose normals differ by more than an angle.
struct BentEdges {
  double by15 = 0, by60 = 0;
};

BentEdges bentEdges(const TriangleSearch& search) {
  const auto vertices = search.vertices();
  const auto triangles = search.triangles();
  const double cosine15 = std::cos(std::numbers::pi / 12), cosine60 = 0.5;
  std::vector<Vector3> normals;
  normals.reserve(triangles.size());
  for (const auto& [a, b, c] : triangles)
    normals.push_back((vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]).normalized());
  BentEdges bent;
  const auto edges = mesh::directedEdgesOf(triangles);
  mesh::forEachEdge(edges, [&](std::span<const mesh::DirectedEdge> around) {
    if (around.size() != 2) return;
    const double cosine = normals[around[0].face].dot(normals[around[1].face]);
    const double length = (vertices[around[0].high()] - vertices[around[0].low()]).norm();
    if (cosine < cosine15) bent.by15 += length;
    if (cosine < cosine60) bent.by60 += length;
  });
  return bent;
}

}  // namespace

Strategy automaticStrategy(const TriangleSearch* search, double referenceLength) {
  constexpr std::size_t kMostTriangles = 30'000;
  if (search == nullptr || !search->hasSigns()) return Strategy::hp;
  const BentEdges bent = bentEdges(*search);
  const bool isPart = bent.by60 > referenceLength / 2 && bent.by60 > bent.by15 / 4;
  const bool isCoarse = search->triangles().size() <= kMostTriangles && bent.by15 > 5 * referenceLength;
  return isPart || isCoarse ? Strategy::hpx : Strategy::hp;
}

}  // namespace hpsdf::detail
