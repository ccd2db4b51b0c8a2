#include "surface/outer_hull.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "mesh/duplicates.h"
#include "surface/crossings.h"
#include "util/chunks.h"
#include "util/refuse.h"

namespace hpsdf::surface {
namespace {

/// Limits of the length of the smallest pieces of subdivided triangles, divided by the longest side of the mesh. This
/// length starts at `kFinest` and is doubled, up to `kCoarsest`, while there are too many pieces.
constexpr double kFinest = 1.0 / 512, kCoarsest = 1.0 / 32;
/// Near holes of the mesh, the smallest pieces are longer by this factor than at intersections, because holes do
/// not merit as many pieces.
constexpr double kCoarserBesideHoles = 8;
constexpr std::size_t kMostPairs = 2'000'000;
constexpr std::size_t kMostPieces = 250'000;  // limit for the number of pieces minus the number of mesh triangles

enum class PieceKind : char {
  surface,      ///< at least one side of the piece is outside the solid
  inner,        ///< both sides of the piece are inside the solid
  undecided,    ///< no triangle intersects the piece; it is unknown whether its sides are inside
  intersected,  ///< triangles intersect the piece, and it is too small to subdivide
  replaced,     ///< the quarters of the piece are in the list instead
};

struct Piece {
  Corners corners;
  std::uint32_t triangle;  ///< index of the mesh triangle that contains the piece
  bool isWhole;
  PieceKind kind = PieceKind::intersected;
};

/// A triangle that intersects the triangle to be subdivided.
struct Cutter {
  std::uint32_t triangle;
  Corners corners;
  bool isCoplanar;  ///< true if both triangles lie in one plane
  /// For each edge of a coplanar cutter: true if the edge can separate inside from outside. It is false if a neighbour
  /// of the cutter continues the cutter's plane across the edge.
  std::array<bool, 3> counts = {true, true, true};
};

double longestSide(const Corners& t) {
  return std::sqrt(std::max({(t[1] - t[0]).squaredNorm(), (t[2] - t[1]).squaredNorm(), (t[0] - t[2]).squaredNorm()}));
}

bool cuts(const Cutter& cutter, const Corners& piece) {
  return cutter.isCoplanar ? edgesIntersect(piece, cutter.corners, cutter.counts) : intersect(piece, cutter.corners);
}

[[noreturn]] void refuse(const TriangleMesh& mesh) {
  detail::refuseMesh(mesh.name,
                     "the mesh intersects itself too often for an outer hull: use the winding number without the "
                     "hull, or repair the mesh first");
}

std::array<Corners, 4> quarters(const Corners& t) {
  const auto& [a, b, c] = t;
  const Vector3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
  return {{{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}};
}

struct TooManyPieces {};

/// Returns the triangle t, shrunk by a millionth towards its centroid. Triangles that meet t only at its boundary
/// do not intersect the shrunk triangle.
Corners shrunk(const Corners& t) {
  const Vector3 middle = (t[0] + t[1] + t[2]) / 3;
  constexpr double kLess = 1e-6;
  return {t[0] + kLess * (middle - t[0]), t[1] + kLess * (middle - t[1]), t[2] + kLess * (middle - t[2])};
}

/// Subdivides triangles that other triangles intersect. All coordinates are scaled to a magnitude of about 1.
class Subdivider {
 public:
  Subdivider(double finest, const Progress& progress) : finest_(finest), progress_(progress) {}

  /// Appends the piece to `pieces` as undecided if no cutter intersects it, or as intersected if it has the
  /// smallest size. Otherwise does the same for its four quarters, recursively. Can be called from any thread.
  /// Throws `TooManyPieces` and `Cancelled`.
  void subdivide(Piece piece, const std::vector<Cutter>& cutters, std::vector<Piece>& pieces) {
    progress_.throwIfCancelled();
    const Corners corners = shrunk(piece.corners);
    const bool isFinest = !canSubdivide(piece.corners);
    std::vector<Cutter> cutting;
    for (const Cutter& cutter : cutters) {
      if (cuts(cutter, corners)) cutting.push_back(cutter);
      if (isFinest && !cutting.empty()) break;
    }
    if (cutting.empty()) piece.kind = PieceKind::undecided;
    if (cutting.empty() || isFinest) return pieces.push_back(piece);
    countQuarters();
    for (const Corners& quarter : quarters(piece.corners)) subdivide({quarter, piece.triangle, false}, cutting, pieces);
  }

  /// Marks an undecided piece as replaced, and appends its quarters to `pieces`. Throws `TooManyPieces`.
  void refine(std::size_t index, std::vector<Piece>& pieces) {
    countQuarters();
    pieces[index].kind = PieceKind::replaced;
    const Piece piece = pieces[index];
    for (const Corners& quarter : quarters(piece.corners))
      pieces.push_back({quarter, piece.triangle, false, PieceKind::undecided});
  }

  bool canSubdivide(const Corners& corners, double factor = 1) const { return longestSide(corners) > factor * finest_; }

 private:
  void countQuarters() {
    if ((added_ += 3) > kMostPieces) throw TooManyPieces();
  }

  double finest_;
  const Progress& progress_;
  std::atomic<std::size_t> added_ = 0;  ///< number of pieces minus the number of triangles
};

using Pair = std::array<std::uint32_t, 2>;

/// Returns the pairs of triangles that intersect. Each pair is listed in both orders, and the list is sorted.
std::vector<Pair> intersectingPairs(const bvh::Hierarchy& hierarchy, const TriangleMesh& mesh,
                                    const Progress& progress) {
  const Crossings crossings = findCrossings(hierarchy, kMostPairs, 0, progress);
  if (!crossings.complete) refuse(mesh);
  std::vector<Pair> pairs;
  for (const Crossing& crossing : crossings.found) {
    const auto [one, other] = crossing.triangles;
    pairs.push_back({one, other});
    pairs.push_back({other, one});
  }
  std::ranges::sort(pairs);
  return pairs;
}

/// Sets `counts` to false for each edge of a coplanar cutter across which another coplanar cutter continues the plane.
/// A neighbour that is folded back onto the cutter does not count as a continuation: it intersects the cutter, and
/// `pairs` lists the two triangles.
void ignoreInnerEdges(const TriangleMesh& mesh, const std::vector<Pair>& pairs, std::vector<Cutter>& cutters) {
  using DirectedEdge = std::array<std::uint32_t, 3>;  // start vertex, end vertex, triangle
  std::vector<DirectedEdge> edges;
  for (const Cutter& cutter : cutters)
    for (int k = 0; k < 3 && cutter.isCoplanar; ++k) {
      const auto& triangle = mesh.triangles[cutter.triangle];
      edges.push_back({triangle[k], triangle[(k + 1) % 3], cutter.triangle});
    }
  std::ranges::sort(edges);
  for (Cutter& cutter : cutters) {
    if (!cutter.isCoplanar) continue;
    const auto& triangle = mesh.triangles[cutter.triangle];
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t from = triangle[(k + 1) % 3], to = triangle[k];
      for (auto edge = std::ranges::lower_bound(edges, DirectedEdge{from, to, 0});
           edge != edges.end() && (*edge)[0] == from && (*edge)[1] == to && cutter.counts[k]; ++edge)
        cutter.counts[k] = std::ranges::binary_search(pairs, Pair{cutter.triangle, (*edge)[2]});
    }
  }
}

/// Subdivides all triangles that other triangles intersect, and returns the pieces of all triangles in the order of the
/// triangles. Multiplies the coordinates of all pieces by `scale`. Throws `TooManyPieces`.
std::vector<Piece> subdivideTriangles(const TriangleMesh& mesh, double scale, const std::vector<Pair>& pairs,
                                      Subdivider& subdivider) {
  const auto scaledCorners = [&](std::uint32_t t) {
    const auto [a, b, c] = cornersOf(mesh, mesh.triangles[t]);
    return Corners{scale * a, scale * b, scale * c};
  };
  // Subdivide each triangle that other triangles intersect, in parallel over these triangles.
  std::vector<std::size_t> firsts;  // index of the first pair of each intersected triangle; at the end pairs.size()
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (i == 0 || pairs[i][0] != pairs[i - 1][0]) firsts.push_back(i);
  firsts.push_back(pairs.size());
  std::vector<std::vector<Piece>> parts(firsts.size() - 1);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t n) {
    const std::uint32_t t = pairs[firsts[n]][0];
    const Corners corners = scaledCorners(t);
    std::vector<Cutter> cutters;
    for (const Pair& pair : std::span(pairs).subspan(firsts[n], firsts[n + 1] - firsts[n])) {
      if (mesh::haveSameCorners(mesh.triangles[t], mesh.triangles[pair[1]]))
        continue;  // a coincident triangle cuts nothing
      const Corners other = scaledCorners(pair[1]);
      cutters.push_back({pair[1], other, areCoplanar(corners, other)});
    }
    ignoreInnerEdges(mesh, pairs, cutters);
    subdivider.subdivide({corners, t, true}, cutters, parts[n]);
  });
  // Merge the pieces of the subdivided triangles with the triangles that no other triangle intersects.
  std::vector<Piece> pieces;
  auto next = parts.begin();
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (next == parts.end() || next->front().triangle != t) {
      pieces.push_back({scaledCorners(t), t, true, PieceKind::undecided});
      continue;
    }
    pieces.insert(pieces.end(), next->begin(), next->end());
    ++next;
  }
  return pieces;
}

/// Tests whether the two sides of a piece of a subdivided triangle are inside the mesh. The test points have the
/// distance `offset` from the piece, in mesh units. Pieces come in with coordinates already multiplied by `scale`.
struct SideProbe {
  const sign::WindingSign& winding;
  double scale, offset;

  Vector3 centroid(const Corners& t) const { return (t[0] + t[1] + t[2]) / (3 * scale); }

  Vector3 step(const Corners& t) const { return offset * (t[1] - t[0]).cross(t[2] - t[0]).stableNormalized(); }

  /// Classifies a piece that no triangle intersects. A degenerate piece is classified as inner and thus dropped,
  /// because the neighbouring pieces contain its edges.
  PieceKind classify(const Corners& corners) const {
    const Vector3 middle = centroid(corners), aside = step(corners);
    const Vector3 before = middle + aside, behind = middle - aside;
    if (before == behind) return PieceKind::inner;
    if (!winding.isInside(before) || !winding.isInside(behind)) return PieceKind::surface;
    double radius = 0;
    for (const Vector3& corner : corners) radius = std::max(radius, (corner / scale - middle).norm());
    const bool isCertain = winding.isSameSideWithin(before, radius) && winding.isSameSideWithin(behind, radius);
    return isCertain ? PieceKind::inner : PieceKind::undecided;
  }

  /// Returns true if an intersected piece lies in the interior of the mesh. Tests points on both sides of each quarter
  /// of the piece, and points around the piece's centroid in fourteen directions, as far away as the piece's longest
  /// side is long. All these points must be inside.
  bool isSurrounded(const Corners& corners) const {
    const Vector3 aside = step(corners);
    for (const Corners& quarter : quarters(corners))
      for (const double side : {-1.0, 1.0})
        if (!winding.isInside(centroid(quarter) + side * aside)) return false;
    const Vector3 middle = centroid(corners);
    const double far = longestSide(corners) / scale;
    const auto isInside = [&](const Vector3& direction) {
      return winding.isInside(middle + far * direction.normalized());
    };
    for (const double side : {-1.0, 1.0})
      for (int axis = 0; axis < 3; ++axis)
        if (!isInside(side * Vector3::Unit(axis))) return false;
    for (int n = 0; n < 8; ++n)
      if (!isInside(Vector3(n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1))) return false;
    return true;
  }

  void classify(std::span<Piece> pieces, const Progress& progress, std::string_view task) const {
    detail::forEachChunk(pieces.size(), 64, progress, task, [&](std::size_t, std::size_t first, std::size_t count) {
      for (Piece& piece : pieces.subspan(first, count)) {
        if (piece.kind == PieceKind::undecided) piece.kind = classify(piece.corners);
        if (piece.kind == PieceKind::intersected)
          piece.kind = isSurrounded(piece.corners) ? PieceKind::inner : PieceKind::surface;
      }
    });
  }
};

/// Returns the pieces of all triangles with their kinds, or std::nullopt if there are too many pieces. Pieces remain
/// undecided only near holes of the mesh.
std::optional<std::vector<Piece>> classifiedPieces(const TriangleMesh& mesh, double scale,
                                                   const std::vector<Pair>& pairs, const sign::WindingSign& winding,
                                                   double finest, const Progress& progress) {
  const Box box = boundingBox(mesh);
  const SideProbe probe{winding, scale, sign::probeDistance(box)};
  const std::string task = "removing inner walls, pieces of 1/" + std::to_string(std::lround(1 / finest));
  Subdivider subdivider(scale * finest * box.sizes().maxCoeff(), progress);
  try {
    std::vector<Piece> pieces = subdivideTriangles(mesh, scale, pairs, subdivider);
    probe.classify(pieces, progress, task);
    // Subdivide undecided pieces repeatedly. They lie near holes, where the winding number varies along a piece.
    for (std::size_t first = 0, end = pieces.size(); first < end; first = end, end = pieces.size()) {
      for (std::size_t i = first; i < end; ++i)
        if (pieces[i].kind == PieceKind::undecided && subdivider.canSubdivide(pieces[i].corners, kCoarserBesideHoles))
          subdivider.refine(i, pieces);
      probe.classify(std::span(pieces).subspan(end), progress, task);
    }
    return pieces;
  } catch (const TooManyPieces&) {
    return std::nullopt;
  }
}

}  // namespace

OuterHull makeOuterHull(const bvh::Hierarchy& hierarchy, const TriangleMesh& mesh, const sign::WindingSign& winding,
                        const Progress& progress) {
  const double scale = scaleToOne(hierarchy.vertices());
  const std::vector<Pair> pairs = intersectingPairs(hierarchy, mesh, progress);
  std::optional<std::vector<Piece>> pieces;
  for (double finest = kFinest; !pieces && finest <= kCoarsest; finest *= 2)
    pieces = classifiedPieces(mesh, scale, pairs, winding, finest, progress);
  if (!pieces) refuse(mesh);
  OuterHull hull{.mesh = {.vertices = mesh.vertices, .triangles = {}, .name = mesh.name}, .sourceTriangles = {}};
  for (const Piece& piece : *pieces) {
    if (piece.kind == PieceKind::inner || piece.kind == PieceKind::replaced) continue;
    hull.sourceTriangles.push_back(piece.triangle);
    if (piece.isWhole) {
      hull.mesh.triangles.push_back(mesh.triangles[piece.triangle]);
      continue;
    }
    const auto first = static_cast<std::uint32_t>(hull.mesh.vertices.size());
    for (const Vector3& corner : piece.corners) hull.mesh.vertices.push_back(corner / scale);
    hull.mesh.triangles.push_back({first, first + 1, first + 2});
  }
  if (hull.sourceTriangles.empty())
    detail::refuseMesh(mesh.name, "no face has the outside on a side, so that there is no outer hull");
  return hull;
}

}  // namespace hpsdf::surface
