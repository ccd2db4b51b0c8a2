#include "distance/hull.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "distance/crossings.h"
#include "hpsdf/error.h"
#include "hpsdf/hull.h"
#include "mesh/duplicates.h"
#include "mesh/message_prefix.h"

namespace hpsdf::distance {
namespace {

using Corners = std::array<Vector3, 3>;

constexpr double kFinest = 1.0 / 512;  // of the mesh's longest side: pieces are not cut further
constexpr std::size_t kMostPairs = 10'000'000;
constexpr std::size_t kMostPieces = 4'000'000;  // besides whole triangles

struct Piece {
  Corners corners;
  std::uint32_t triangle;  ///< of which it is a part
  bool isWhole;
  bool isCut;  ///< by others still
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
  throw Error(messagePrefix(mesh) +
              "it meets itself in too many places for a hull: leave out the hull, or mend the mesh first");
}

/// Cuts triangles where others meet them. All coordinates are scaled to order 1.
class Cutter {
 public:
  Cutter(const TriangleMesh& mesh, double finest) : mesh_(mesh), finest_(finest) {}

  /// Adds the pieces of a triangle.
  void add(const Corners& corners, std::uint32_t triangle, const std::vector<Crosser>& crossers) {
    add({corners, triangle, true, false}, crossers);
  }

  std::vector<Piece> pieces;

 private:
  void add(Piece piece, const std::vector<Crosser>& crossers) {
    std::vector<Crosser> cutting;
    for (const Crosser& crosser : crossers)
      if (cuts(crosser, piece.corners)) cutting.push_back(crosser);
    piece.isCut = !cutting.empty();
    if (pieces.size() >= mesh_.triangles.size() + kMostPieces) refuse(mesh_);
    if (!piece.isCut || longestSide(piece.corners) <= finest_) {
      pieces.push_back(piece);
      return;
    }
    const auto& [a, b, c] = piece.corners;
    const Vector3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
    for (const Corners& quarter : {Corners{a, ab, ca}, Corners{ab, b, bc}, Corners{ca, bc, c}, Corners{ab, bc, ca}})
      add({quarter, piece.triangle, false, false}, cutting);
  }

  const TriangleMesh& mesh_;
  double finest_;
};

using Pair = std::array<std::uint32_t, 2>;

/// Each pair of triangles that meet, both ways, sorted.
std::vector<Pair> pairsThatMeet(const Hierarchy& hierarchy, const TriangleMesh& mesh) {
  const Crossings crossings = findCrossings(hierarchy, kMostPairs, 0);
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

bool hasSide(const std::array<std::uint32_t, 3>& triangle, std::uint32_t from, std::uint32_t to) {
  for (int k = 0; k < 3; ++k)
    if (triangle[k] == from && triangle[(k + 1) % 3] == to) return true;
  return false;
}

/// Neighbours go on beyond the side that they share, unless they are folded onto each other and so meet.
void leaveOutInnerSides(const TriangleMesh& mesh, const std::vector<Pair>& pairs, std::vector<Crosser>& crossers) {
  for (Crosser& crosser : crossers) {
    if (!crosser.inPlane) continue;
    const auto& triangle = mesh.triangles[crosser.triangle];
    for (int k = 0; k < 3; ++k)
      crosser.counts[k] = std::ranges::none_of(crossers, [&](const Crosser& other) {
        return other.inPlane && hasSide(mesh.triangles[other.triangle], triangle[(k + 1) % 3], triangle[k]) &&
               !std::ranges::binary_search(pairs, Pair{crosser.triangle, other.triangle});
      });
  }
}

std::vector<Piece> piecesOf(const Hierarchy& hierarchy, const TriangleMesh& mesh, double scale) {
  const std::vector<Pair> pairs = pairsThatMeet(hierarchy, mesh);
  const auto cornersOf = [&](std::uint32_t t) {
    const auto& [a, b, c] = mesh.triangles[t];
    return Corners{scale * mesh.vertices[a], scale * mesh.vertices[b], scale * mesh.vertices[c]};
  };
  Cutter cutter(mesh, scale * kFinest * boundingBox(mesh).sizes().maxCoeff());
  auto next = pairs.begin();
  std::vector<Crosser> crossers;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Corners corners = cornersOf(t);
    crossers.clear();
    for (; next != pairs.end() && (*next)[0] == t; ++next) {
      const std::uint32_t other = (*next)[1];
      if (areTwins(mesh.triangles[t], mesh.triangles[other])) continue;  // cuts nothing of it
      crossers.push_back({other, cornersOf(other), lieInOnePlane(corners, cornersOf(other))});
    }
    leaveOutInnerSides(mesh, pairs, crossers);
    cutter.add(corners, t, crossers);
  }
  return std::move(cutter.pieces);
}

/// Whether each has the inside on both sides. One without an area has: its neighbours hold its sides.
std::vector<char> areBuried(const std::vector<Piece>& pieces, const Inside& inside, double scale, double aside) {
  std::vector<Vector3> before, behind;
  for (const Piece& piece : pieces) {
    const auto& [a, b, c] = piece.corners;
    const Vector3 middle = (a + b + c) / (3 * scale);
    const Vector3 step = aside * (b - a).cross(c - a).stableNormalized();
    before.push_back(middle + step);
    behind.push_back(middle - step);
  }
  const std::vector<char> inFront = inside.contains(before), inBack = inside.contains(behind);
  std::vector<char> buried(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i)
    buried[i] = before[i] == behind[i] || (!pieces[i].isCut && inFront[i] && inBack[i]);
  return buried;
}

}  // namespace

Hull hullOf(const Hierarchy& hierarchy, const TriangleMesh& mesh, const Inside& inside) {
  const double scale = scaleToOne(hierarchy.vertices());
  const std::vector<Piece> pieces = piecesOf(hierarchy, mesh, scale);
  const std::vector<char> buried = areBuried(pieces, inside, scale, besideSurface(boundingBox(mesh)));
  Hull hull{.mesh = {.vertices = mesh.vertices, .triangles = {}, .name = mesh.name}, .triangles = {}};
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (buried[i]) continue;
    const Piece& piece = pieces[i];
    hull.triangles.push_back(piece.triangle);
    if (piece.isWhole) {
      hull.mesh.triangles.push_back(mesh.triangles[piece.triangle]);
      continue;
    }
    const auto first = static_cast<std::uint32_t>(hull.mesh.vertices.size());
    for (const Vector3& corner : piece.corners) hull.mesh.vertices.push_back(corner / scale);
    hull.mesh.triangles.push_back({first, first + 1, first + 2});
  }
  if (hull.triangles.empty()) throw Error(messagePrefix(mesh) + "no face has the outside beside it: there is no hull");
  return hull;
}

}  // namespace hpsdf::distance

namespace hpsdf {

TriangleMesh hull(const TriangleMesh& mesh) {
  distance::requireSurface(mesh);
  const distance::Hierarchy hierarchy(mesh, boundingBox(mesh));
  const distance::Inside inside(hierarchy, mesh, distance::HoleRims(hierarchy));
  return distance::hullOf(hierarchy, mesh, inside).mesh;
}

}  // namespace hpsdf
