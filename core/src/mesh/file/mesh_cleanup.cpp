#include <tbb/parallel_for.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "hpsdf/mesh_file.h"
#include "mesh/duplicates.h"
#include "mesh/orientation.h"
#include "util/refuse.h"

namespace hpsdf {
namespace mesh {
namespace {

using PositionBits = std::array<std::uint64_t, 3>;

/// A hash table of the first vertex at each position.
class PositionTable {
 public:
  /// Makes a table for the vertices of this list, which must outlive the table.
  explicit PositionTable(const std::vector<Vector3>& vertices)
      : vertices_(vertices), slots_(std::bit_ceil(2 * vertices.size() + 1), kEmpty) {}

  /// Returns the first vertex that was asked for at the position of the vertex `v`, or `v` itself if it is the first.
  std::uint32_t firstAt(std::uint32_t v) {
    const PositionBits key = bitsOf(vertices_[v]);
    for (std::size_t slot = XXH3_64bits(key.data(), sizeof key);; ++slot) {
      std::uint32_t& found = slots_[slot & (slots_.size() - 1)];
      if (found == kEmpty) found = v;
      if (bitsOf(vertices_[found]) == key) return found;
    }
  }

 private:
  static constexpr std::uint32_t kEmpty = std::numeric_limits<std::uint32_t>::max();

  static PositionBits bitsOf(const Vector3& v) {
    return {std::bit_cast<std::uint64_t>(v.x()), std::bit_cast<std::uint64_t>(v.y()),
            std::bit_cast<std::uint64_t>(v.z())};
  }

  const std::vector<Vector3>& vertices_;
  std::vector<std::uint32_t> slots_;
};

void requireUsable(const TriangleMesh& mesh) {
  constexpr std::size_t kMost = std::numeric_limits<std::uint32_t>::max();
  if (mesh.vertices.size() >= kMost || mesh.triangles.size() >= kMost)
    detail::refuseMesh(mesh.name, "more than 4294967294 vertices or faces; simplify the mesh first");
  requireValidIndices(mesh);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (!(mesh.vertices[i].cwiseAbs().array() <= kLargestCoordinate).all())
      detail::refuseMesh(
          mesh.name, "vertex ", i + 1,
          " has a coordinate that is not a finite number (or beyond 1e100); repair or export the mesh again");
}

/// Welds vertices at the same position: all triangles use the first of these vertices. Returns the number of
/// vertices that are replaced by another one.
std::size_t weld(TriangleMesh& mesh) {
  for (Vector3& v : mesh.vertices) v.array() += 0.0;  // This turns -0 into 0, so that equal positions have equal bits.
  PositionTable table(mesh.vertices);
  std::vector<std::uint32_t> representative(mesh.vertices.size());
  std::size_t welded = 0;
  for (std::uint32_t v = 0; v < representative.size(); ++v) {
    representative[v] = table.firstAt(v);
    welded += representative[v] != v;
  }
  for (Triangle& triangle : mesh.triangles)
    for (std::uint32_t& v : triangle) v = representative[v];
  return welded;
}

/// Returns true if the corners of a triangle are collinear up to rounding errors. The tolerance is relative to the
/// edge lengths. The result thus does not depend on the size of the mesh, and is false for thin slivers with an area.
bool hasNoArea(const TriangleMesh& mesh, const Triangle& triangle) {
  const auto [a, b, c] = cornersOf(mesh, triangle);
  std::array<Vector3, 3> edges = {b - a, c - b, a - c};
  double scale = 0;
  for (const Vector3& edge : edges) scale = std::max(scale, edge.cwiseAbs().maxCoeff());
  if (scale == 0) return true;
  for (Vector3& edge : edges) edge /= scale;  // Products of scaled edges neither underflow nor overflow.
  std::sort(edges.begin(), edges.end(),
            [](const Vector3& u, const Vector3& v) { return u.squaredNorm() < v.squaredNorm(); });
  // Compute the tolerance for the cross product of the two shorter edges, which suffers least from cancellation.
  const double rounding = 4 * std::numeric_limits<double>::epsilon() * edges[0].norm() * edges[1].norm();
  return edges[0].cross(edges[1]).norm() <= rounding;
}

/// Maps each directed edge to the triangle that it belongs to.
class EdgeMap {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();  ///< no triangle has the edge
  static constexpr std::uint32_t kSeveral = kNone - 1;                               ///< several have the edge

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

/// Returns triangle t with its corners in cyclic order so that the first two corners span the longest edge. If the
/// corners are collinear, the last corner lies between the first two.
Triangle longestEdgeFirst(const TriangleMesh& mesh, Triangle t) {
  const auto squared = [&](int i) { return (mesh.vertices[t[i]] - mesh.vertices[t[(i + 1) % 3]]).squaredNorm(); };
  const std::array<double, 3> lengths = {squared(0), squared(1), squared(2)};
  std::rotate(t.begin(), t.begin() + (std::max_element(lengths.begin(), lengths.end()) - lengths.begin()), t.end());
  return t;
}

/// Flips the longest edge of a triangle if both new triangles have an area and no edge gets more than two
/// triangles. Returns true if the edge was flipped.
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

/// Returns the triangles without an area, in ascending order.
std::vector<std::uint32_t> facesWithoutArea(const TriangleMesh& mesh) {
  std::vector<char> isFlat(mesh.triangles.size());
  tbb::parallel_for(std::size_t{0}, isFlat.size(),
                    [&](std::size_t f) { isFlat[f] = hasNoArea(mesh, mesh.triangles[f]); });
  std::vector<std::uint32_t> faces;
  for (std::size_t f = 0; f < isFlat.size(); ++f)
    if (isFlat[f]) faces.push_back(static_cast<std::uint32_t>(f));
  return faces;
}

/// Removes triangles with collinear corners by flipping their longest edges. Returns the number of flips, and leaves in
/// `flat` the triangles without an area that cannot be flipped.
///
/// Collinear triangles come from polygons and CAD facets with corners along a straight side. Dropping them would open
/// the mesh. A flip instead splits the neighbour across the longest edge into two triangles, at the collinear
/// triangle's middle corner. The flip changes neither the surface nor the number of triangles. If a flip is impossible,
/// the collinear triangle remains unchanged.
std::size_t flipCollinearFaces(TriangleMesh& mesh, std::vector<std::uint32_t>& flat) {
  if (flat.empty()) return 0;
  EdgeMap edges(mesh.triangles);
  std::size_t flips = 0;
  // Flip in rounds, because a flip may become possible only after a collinear neighbour is flipped. Each round
  // except the last flips at least one triangle.
  for (bool changed = true; changed;) {
    const std::size_t flipped = std::erase_if(flat, [&](std::uint32_t face) { return flip(mesh, edges, face); });
    flips += flipped;
    changed = flipped > 0;
  }
  return flips;
}

/// The number of triangles that one clean-up step dropped, and the centroid of the first of these triangles.
struct Dropped {
  std::size_t faces = 0;
  Vector3 position = Vector3::Zero();
};

/// Drops the triangles for which `isBad` returns true. It is called with each triangle and its index.
template <typename IsBad>
Dropped drop(TriangleMesh& mesh, const IsBad& isBad) {
  Dropped dropped;
  std::uint32_t index = 0;
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    if (!isBad(t, index++)) return false;
    if (dropped.faces++ == 0) dropped.position = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
    return true;
  });
  return dropped;
}

Dropped dropDuplicates(TriangleMesh& mesh) {
  const std::vector<char> redundant = redundantFaces(mesh.triangles);
  return drop(mesh, [&](const Triangle&, std::uint32_t f) { return redundant[f] != 0; });
}

std::size_t dropUnusedVertices(TriangleMesh& mesh) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> newIndex(mesh.vertices.size(), kUnused);
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t v : triangle) newIndex[v] = 0;
  std::uint32_t kept = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (newIndex[i] == kUnused) continue;
    mesh.vertices[kept] = mesh.vertices[i];
    newIndex[i] = kept++;
  }
  for (Triangle& triangle : mesh.triangles)
    for (std::uint32_t& v : triangle) v = newIndex[v];
  const std::size_t dropped = mesh.vertices.size() - kept;
  mesh.vertices.resize(kept);
  return dropped;
}

void requireFaces(const TriangleMesh& mesh, std::size_t facesBefore) {
  if (!mesh.triangles.empty()) return;
  constexpr const char* kAdvice = "; a surface of triangles or polygons is needed";
  if (facesBefore == 0) detail::refuseMesh(mesh.name, "no faces", kAdvice);
  detail::refuseMesh(mesh.name, "no face with an area (", facesBefore, facesBefore == 1 ? " face is" : " faces are",
                     " degenerate)", kAdvice);
}

}  // namespace
}  // namespace mesh

ImportedMesh cleaned(TriangleMesh mesh) {
  using namespace mesh;
  requireUsable(mesh);
  const std::size_t facesBefore = mesh.triangles.size();
  const std::size_t welded = weld(mesh);
  const Dropped collapsed =
      drop(mesh, [](const Triangle& t, std::uint32_t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  std::vector<std::uint32_t> flat = facesWithoutArea(mesh);
  const std::size_t flipped = flipCollinearFaces(mesh, flat);
  const Dropped withoutArea = drop(mesh, [&](const Triangle& t, std::uint32_t f) {
    return std::ranges::binary_search(flat, f) && hasNoArea(mesh, t);
  });
  const Dropped duplicates = dropDuplicates(mesh);
  requireFaces(mesh, facesBefore);
  const std::size_t unreferenced = dropUnusedVertices(mesh) - welded;

  ImportedMesh result{std::move(mesh), {}};
  MeshReport& report = result.report = inspect(result.mesh);
  report.weldedVertices = welded;
  report.degenerateFaces = collapsed.faces + withoutArea.faces;
  report.degeneratePosition = (collapsed.faces > 0 ? collapsed : withoutArea).position;
  report.flippedFaces = flipped;
  report.duplicateFaces = duplicates.faces;
  report.duplicatePosition = duplicates.position;
  report.unreferencedVertices = unreferenced;
  const bool isClosed = report.unbalancedEdges == 0;
  if (report.volume < 0 && hasReliableVolumeSign(report.volume, report.area, report.box, isClosed)) {
    for (Triangle& triangle : result.mesh.triangles) std::swap(triangle[1], triangle[2]);
    report.reversed = true;
    report.volume = signedVolume(result.mesh);
  }
  return result;
}

}  // namespace hpsdf
