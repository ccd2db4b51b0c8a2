#include "mesh/cleanup/collinear_faces.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

namespace hpsdf::mesh {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

/// Maps each directed edge to the triangle that it belongs to.
class EdgeMap {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();  ///< no triangle
  static constexpr std::uint32_t kSeveral = kNone - 1;                               ///< more than one triangle

  explicit EdgeMap(const std::vector<Triangle>& triangles) {
    faceOf_.reserve(3 * triangles.size());
    for (std::size_t f = 0; f < triangles.size(); ++f)
      for (int i = 0; i < 3; ++i) {
        const auto face = static_cast<std::uint32_t>(f);
        const auto [entry, isNew] = faceOf_.try_emplace(key(triangles[f][i], triangles[f][(i + 1) % 3]), face);
        if (!isNew) entry->second = kSeveral;
      }
  }

  std::uint32_t face(std::uint32_t from, std::uint32_t to) const {
    const auto entry = faceOf_.find(key(from, to));
    return entry == faceOf_.end() ? kNone : entry->second;
  }

  void set(const Triangle& t, std::uint32_t face) {
    for (int i = 0; i < 3; ++i) faceOf_[key(t[i], t[(i + 1) % 3])] = face;
  }

  void erase(std::uint32_t from, std::uint32_t to) { faceOf_.erase(key(from, to)); }

 private:
  static std::uint64_t key(std::uint32_t from, std::uint32_t to) { return std::uint64_t{from} << 32 | to; }

  std::unordered_map<std::uint64_t, std::uint32_t> faceOf_;
};

/// The triangle rotated so that its longest edge comes first. The last corner of a collinear triangle is then the
/// middle one.
Triangle longestEdgeFirst(const TriangleMesh& mesh, Triangle t) {
  const auto squared = [&](int i) { return (mesh.vertices[t[i]] - mesh.vertices[t[(i + 1) % 3]]).squaredNorm(); };
  const std::array<double, 3> lengths = {squared(0), squared(1), squared(2)};
  std::rotate(t.begin(), t.begin() + (std::max_element(lengths.begin(), lengths.end()) - lengths.begin()), t.end());
  return t;
}

/// Flips the longest edge of a triangle where that yields two triangles with areas and no edge of more than two.
bool flip(TriangleMesh& mesh, EdgeMap& edges, std::uint32_t face) {
  const auto [a, b, middle] = longestEdgeFirst(mesh, mesh.triangles[face]);
  const std::uint32_t neighbour = edges.face(b, a);
  if (edges.face(a, b) != face || neighbour >= EdgeMap::kSeveral) return false;
  const Triangle& other = mesh.triangles[neighbour];
  const auto opposite = *std::find_if(other.begin(), other.end(), [a = a, b = b](auto v) { return v != a && v != b; });
  if (opposite == middle || edges.face(middle, opposite) != EdgeMap::kNone ||
      edges.face(opposite, middle) != EdgeMap::kNone)
    return false;  // The new edge exists already and would become non-manifold.
  const Triangle first = {middle, a, opposite};
  const Triangle second = {middle, opposite, b};
  if (hasNoArea(mesh, first) || hasNoArea(mesh, second)) return false;
  edges.erase(a, b);
  edges.erase(b, a);
  edges.set(first, face);
  edges.set(second, neighbour);
  mesh.triangles[face] = first;
  mesh.triangles[neighbour] = second;
  return true;
}

}  // namespace

bool hasNoArea(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const Vector3& a = mesh.vertices[triangle[0]];
  const Vector3& b = mesh.vertices[triangle[1]];
  const Vector3& c = mesh.vertices[triangle[2]];
  std::array<Vector3, 3> edges = {b - a, c - b, a - c};
  double scale = 0;
  for (const Vector3& edge : edges) scale = std::max(scale, edge.cwiseAbs().maxCoeff());
  if (scale == 0) return true;
  for (Vector3& edge : edges) edge /= scale;  // Products of scaled edges neither underflow nor overflow.
  std::sort(edges.begin(), edges.end(),
            [](const Vector3& u, const Vector3& v) { return u.squaredNorm() < v.squaredNorm(); });
  // The cross product of the two shorter edges carries the least cancellation.
  const double rounding = 4 * std::numeric_limits<double>::epsilon() * edges[0].norm() * edges[1].norm();
  return edges[0].cross(edges[1]).norm() <= rounding;
}

std::size_t flipCollinearFaces(TriangleMesh& mesh) {
  std::vector<std::uint32_t> pending;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    if (hasNoArea(mesh, mesh.triangles[f])) pending.push_back(static_cast<std::uint32_t>(f));
  if (pending.empty()) return 0;

  EdgeMap edges(mesh.triangles);
  std::size_t flips = 0;
  // A flip may be possible only after that of a neighbour without area, hence the rounds. Every round but the last
  // flips a triangle.
  for (bool changed = true; changed;) {
    const std::size_t flipped = std::erase_if(pending, [&](std::uint32_t face) { return flip(mesh, edges, face); });
    flips += flipped;
    changed = flipped > 0;
  }
  return flips;
}

}  // namespace hpsdf::mesh
