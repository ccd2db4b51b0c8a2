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

#include "hpsdf/error.h"
#include "mesh/duplicates.h"
#include "mesh/message_prefix.h"
#include "surface/crossings.h"
#include "util/chunks.h"

namespace hpsdf::distance {
namespace {

using Corners = std::array<Vector3, 3>;

/// Of the mesh's longest side: pieces are not cut further, unless they are too many; then twice as large ones, and so
/// on.
constexpr double kFinest = 1.0 / 512, kCoarsest = 1.0 / 32;
constexpr double kCoarserBesideHoles = 8;  // times: what only holes leave unsure is not worth as many pieces
constexpr std::size_t kMostPairs = 2'000'000;
constexpr std::size_t kMostPieces = 250'000;  // besides whole triangles

/// Whether both sides of a triangle, or of a part of it, are the inside; `cut`: others cut it still; `replaced`: by its
/// parts.
enum class Kind : char { surface, buried, unsure, cut, replaced };

struct Piece {
  Corners corners;
  std::uint32_t triangle;  ///< of which it is a part
  bool isWhole;
  Kind kind = Kind::cut;
};

/// One of the triangles that a triangle meets.
struct Crosser {
  std::uint32_t triangle;
  Corners corners;
  /// Lies in its plane: then only sides change what is beside that one, and only those that count: no neighbour goes on
  /// in the plane.
  bool inPlane;
  std::array<bool, 3> counts = {true, true, true};
};

double longestSide(const Corners& t) {
  return std::sqrt(std::max({(t[1] - t[0]).squaredNorm(), (t[2] - t[1]).squaredNorm(), (t[0] - t[2]).squaredNorm()}));
}

bool cuts(const Crosser& crosser, const Corners& piece) {
  return crosser.inPlane ? sidesCut(piece, crosser.corners, crosser.counts) : meet(piece, crosser.corners);
}

[[noreturn]] void refuse(const TriangleMesh& mesh) {
  throw Error(messagePrefix(mesh.name) +
              "it meets itself in too many places for a hull: leave out the hull, or mend the mesh first");
}

std::array<Corners, 4> quarters(const Corners& t) {
  const auto& [a, b, c] = t;
  const Vector3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
  return {{{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}};
}

struct TooManyPieces {};

/// What of a triangle is no nearer to its sides than rounding: others that share these cut nothing of it.
Corners interior(const Corners& t) {
  const Vector3 middle = (t[0] + t[1] + t[2]) / 3;
  constexpr double kLess = 1e-6;
  return {t[0] + kLess * (middle - t[0]), t[1] + kLess * (middle - t[1]), t[2] + kLess * (middle - t[2])};
}

/// Cuts triangles where others meet them. All coordinates are scaled to order 1.
class Cutter {
 public:
  Cutter(double finest, const Progress& progress) : finest_(finest), progress_(progress) {}

  /// Adds to the pieces those of one: cut, or unsure where others cut them no more. From any thread. Throws
  /// `TooManyPieces`, `Cancelled`.
  void add(Piece piece, const std::vector<Crosser>& crossers, std::vector<Piece>& pieces) {
    progress_.pause();
    const Corners corners = interior(piece.corners);
    const bool isFinest = !canCut(piece.corners);
    std::vector<Crosser> cutting;
    for (const Crosser& crosser : crossers) {
      if (cuts(crosser, corners)) cutting.push_back(crosser);
      if (isFinest && !cutting.empty()) break;
    }
    if (cutting.empty()) piece.kind = Kind::unsure;
    if (cutting.empty() || isFinest) return pieces.push_back(piece);
    countMore();
    for (const Corners& quarter : quarters(piece.corners)) add({quarter, piece.triangle, false}, cutting, pieces);
  }

  /// Puts the quarters of one that is unsure in its place. Throws `TooManyPieces`.
  void refine(std::size_t at, std::vector<Piece>& pieces) {
    countMore();
    pieces[at].kind = Kind::replaced;
    const Piece piece = pieces[at];
    for (const Corners& quarter : quarters(piece.corners))
      pieces.push_back({quarter, piece.triangle, false, Kind::unsure});
  }

  bool canCut(const Corners& corners, double times = 1) const { return longestSide(corners) > times * finest_; }

 private:
  void countMore() {
    if ((more_ += 3) > kMostPieces) throw TooManyPieces();
  }

  double finest_;
  const Progress& progress_;
  std::atomic<std::size_t> more_ = 0;  ///< pieces than triangles
};

using Pair = std::array<std::uint32_t, 2>;

/// Each pair of triangles that meet, both ways, sorted.
std::vector<Pair> pairsThatMeet(const Hierarchy& hierarchy, const TriangleMesh& mesh, const Progress& progress) {
  const Crossings crossings = findCrossings(hierarchy, kMostPairs, 0, progress);
  if (!crossings.all) refuse(mesh);
  std::vector<Pair> pairs;
  for (const Crossing& crossing : crossings.found) {
    const auto [one, other] = crossing.triangles;
    pairs.push_back({one, other});
    pairs.push_back({other, one});
  }
  std::ranges::sort(pairs);
  return pairs;
}

/// Neighbours go on beyond the side that they share, unless they are folded onto each other and so meet.
void leaveOutInnerSides(const TriangleMesh& mesh, const std::vector<Pair>& pairs, std::vector<Crosser>& crossers) {
  using DirectedSide = std::array<std::uint32_t, 3>;  // from, to, of which triangle
  std::vector<DirectedSide> sides;
  for (const Crosser& crosser : crossers)
    for (int k = 0; k < 3 && crosser.inPlane; ++k) {
      const auto& triangle = mesh.triangles[crosser.triangle];
      sides.push_back({triangle[k], triangle[(k + 1) % 3], crosser.triangle});
    }
  std::ranges::sort(sides);
  for (Crosser& crosser : crossers) {
    if (!crosser.inPlane) continue;
    const auto& triangle = mesh.triangles[crosser.triangle];
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t from = triangle[(k + 1) % 3], to = triangle[k];
      for (auto side = std::ranges::lower_bound(sides, DirectedSide{from, to, 0});
           side != sides.end() && (*side)[0] == from && (*side)[1] == to && crosser.counts[k]; ++side)
        crosser.counts[k] = std::ranges::binary_search(pairs, Pair{crosser.triangle, (*side)[2]});
    }
  }
}

/// Pieces of all triangles. Coordinates are scaled to order 1. Throws `TooManyPieces`.
std::vector<Piece> cutTriangles(const TriangleMesh& mesh, double scale, const std::vector<Pair>& pairs,
                                Cutter& cutter) {
  const auto cornersOf = [&](std::uint32_t t) {
    const auto& [a, b, c] = mesh.triangles[t];
    return Corners{scale * mesh.vertices[a], scale * mesh.vertices[b], scale * mesh.vertices[c]};
  };
  std::vector<std::size_t> firsts;  // of the pairs of each triangle that has any, and the end
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (i == 0 || pairs[i][0] != pairs[i - 1][0]) firsts.push_back(i);
  firsts.push_back(pairs.size());
  std::vector<std::vector<Piece>> parts(firsts.size() - 1);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t n) {
    const std::uint32_t t = pairs[firsts[n]][0];
    const Corners corners = cornersOf(t);
    std::vector<Crosser> crossers;
    for (const Pair& pair : std::span(pairs).subspan(firsts[n], firsts[n + 1] - firsts[n])) {
      if (areTwins(mesh.triangles[t], mesh.triangles[pair[1]])) continue;  // cuts nothing of it
      const Corners other = cornersOf(pair[1]);
      crossers.push_back({pair[1], other, lieInOnePlane(corners, other)});
    }
    leaveOutInnerSides(mesh, pairs, crossers);
    cutter.add({corners, t, true}, crossers, parts[n]);
  });
  std::vector<Piece> pieces;
  auto next = parts.begin();
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (next == parts.end() || next->front().triangle != t) {
      pieces.push_back({cornersOf(t), t, true, Kind::unsure});
      continue;
    }
    pieces.insert(pieces.end(), next->begin(), next->end());
    ++next;
  }
  return pieces;
}

/// What a piece is that no triangle meets: surface, if it is that in its middle. One without an area has the inside on
/// both sides: its neighbours hold its sides.
Kind kindOf(const Corners& corners, const Inside& inside, double scale, double aside) {
  const auto& [a, b, c] = corners;
  const Vector3 middle = (a + b + c) / (3 * scale);
  const Vector3 step = aside * (b - a).cross(c - a).stableNormalized();
  const Vector3 before = middle + step, behind = middle - step;
  if (before == behind) return Kind::buried;
  if (!inside.contains(before) || !inside.contains(behind)) return Kind::surface;
  double reach = 0;
  for (const Vector3& corner : corners) reach = std::max(reach, (corner / scale - middle).norm());
  return inside.isSameWithin(before, reach) && inside.isSameWithin(behind, reach) ? Kind::buried : Kind::unsure;
}

/// Whether all is inside around a small piece that others cut, before and behind it and in fourteen directions, as far
/// as it is long: then it is taken for what is left of a wall.
bool isSurrounded(const Corners& corners, const Inside& inside, double scale, double aside) {
  const auto& [a, b, c] = corners;
  const Vector3 step = aside * (b - a).cross(c - a).stableNormalized();
  const auto middleOf = [&](const Corners& t) { return Vector3((t[0] + t[1] + t[2]) / (3 * scale)); };
  for (const Corners& quarter : quarters(corners))
    for (const double sign : {-1.0, 1.0})
      if (!inside.contains(middleOf(quarter) + sign * step)) return false;
  const Vector3 middle = middleOf(corners);
  const double far = longestSide(corners) / scale;
  const auto isInside = [&](const Vector3& direction) {
    return inside.contains(middle + far * direction.normalized());
  };
  for (const double sign : {-1.0, 1.0})
    for (int axis = 0; axis < 3; ++axis)
      if (!isInside(sign * Vector3::Unit(axis))) return false;
  for (int n = 0; n < 8; ++n)
    if (!isInside(Vector3(n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1))) return false;
  return true;
}

void setKinds(std::span<Piece> pieces, const Inside& inside, double scale, double aside, const Progress& progress,
              std::string_view task) {
  forEachChunk(pieces.size(), 64, progress, task, [&](std::size_t, std::size_t first, std::size_t count) {
    for (Piece& piece : pieces.subspan(first, count)) {
      if (piece.kind == Kind::unsure) piece.kind = kindOf(piece.corners, inside, scale, aside);
      if (piece.kind == Kind::cut)
        piece.kind = isSurrounded(piece.corners, inside, scale, aside) ? Kind::buried : Kind::surface;
    }
  });
}

/// Pieces that are buried, or surface; beside holes some that are too small to be cut further are unsure. Coordinates
/// are scaled to order 1. Nothing if they are too many.
std::optional<std::vector<Piece>> piecesOf(const TriangleMesh& mesh, double scale, const std::vector<Pair>& pairs,
                                           const Inside& inside, double finest, const Progress& progress) {
  const Box box = boundingBox(mesh);
  const double aside = besideSurface(box);
  const std::string task = "leaving out walls within, pieces of 1/" + std::to_string(std::lround(1 / finest));
  Cutter cutter(scale * finest * box.sizes().maxCoeff(), progress);
  try {
    std::vector<Piece> pieces = cutTriangles(mesh, scale, pairs, cutter);
    setKinds(pieces, inside, scale, aside, progress, task);
    // Beside holes the winding number changes along a piece.
    for (std::size_t first = 0, end = pieces.size(); first < end; first = end, end = pieces.size()) {
      for (std::size_t i = first; i < end; ++i)
        if (pieces[i].kind == Kind::unsure && cutter.canCut(pieces[i].corners, kCoarserBesideHoles))
          cutter.refine(i, pieces);
      setKinds(std::span(pieces).subspan(end), inside, scale, aside, progress, task);
    }
    return pieces;
  } catch (const TooManyPieces&) {
    return std::nullopt;
  }
}

}  // namespace

Hull hullOf(const Hierarchy& hierarchy, const TriangleMesh& mesh, const Inside& inside, const Progress& progress) {
  const double scale = scaleToOne(hierarchy.vertices());
  const std::vector<Pair> pairs = pairsThatMeet(hierarchy, mesh, progress);
  std::optional<std::vector<Piece>> pieces;
  for (double finest = kFinest; !pieces && finest <= kCoarsest; finest *= 2)
    pieces = piecesOf(mesh, scale, pairs, inside, finest, progress);
  if (!pieces) refuse(mesh);
  Hull hull{.mesh = {.vertices = mesh.vertices, .triangles = {}, .name = mesh.name}, .triangles = {}};
  for (const Piece& piece : *pieces) {
    if (piece.kind == Kind::buried || piece.kind == Kind::replaced) continue;
    hull.triangles.push_back(piece.triangle);
    if (piece.isWhole) {
      hull.mesh.triangles.push_back(mesh.triangles[piece.triangle]);
      continue;
    }
    const auto first = static_cast<std::uint32_t>(hull.mesh.vertices.size());
    for (const Vector3& corner : piece.corners) hull.mesh.vertices.push_back(corner / scale);
    hull.mesh.triangles.push_back({first, first + 1, first + 2});
  }
  if (hull.triangles.empty())
    throw Error(messagePrefix(mesh.name) + "no face has the outside beside it: there is no hull");
  return hull;
}

}  // namespace hpsdf::distance
