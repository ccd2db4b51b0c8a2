#include "combine/boolean_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include "bvh/hierarchy.h"
#include "combine/similarity.h"
#include "combine/triangle_cutter.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/random_points.h"
#include "surface/crossings.h"
#include "util/chunks.h"
#include "util/refuse.h"

namespace hpsdf::combine {
namespace {

// Distances in coordinates of about 1. Corners of a triangle within kSnapped of another triangle's plane lie in that
// plane. A piece whose middle is within kCoincident of another surface lies in that surface; as this is far less, such
// pieces have been cut along the other surface's edges. Triangles within kReach of each other are considered at all.
constexpr double kSnapped = 0x1p-42, kCoincident = 0x1p-45, kReach = 0x1p-41;

// Pieces narrower than this are left out: other surfaces may cross them without cutting them, and their neighbours are
// no farther from any point than they are, up to this length.
constexpr double kNarrow = 0x1p-41;

constexpr std::size_t kMostCrossings = 20'000'000;
constexpr std::size_t kTrianglesPerChunk = 256;

using surface::Corners;

/// The triangles of all solids in coordinates of about 1, and which of them cross.
struct Arrangement {
  TriangleMesh mesh;                    ///< of all solids, one after the other
  std::vector<std::uint32_t> solidOf;   ///< for each triangle
  double scale = 1;                     ///< a power of two, by which coordinates are multiplied
  std::vector<std::uint32_t> partners;  ///< the triangles that may cross each triangle, one list after the other
  std::vector<std::size_t> firstOf;     ///< for each triangle, where its list begins; and the end of the last list

  std::span<const std::uint32_t> partnersOf(std::size_t triangle) const {
    return std::span(partners).subspan(firstOf[triangle], firstOf[triangle + 1] - firstOf[triangle]);
  }
  Corners cornersOf(std::size_t triangle) const { return hpsdf::cornersOf(mesh, mesh.triangles[triangle]); }
};

void join(Arrangement& all, const std::vector<MeshSolid>& solids) {
  for (std::uint32_t solid = 0; solid < solids.size(); ++solid) {
    const TriangleMesh& mesh = *solids[solid].mesh;
    const auto first = static_cast<std::uint32_t>(all.mesh.vertices.size());
    all.mesh.vertices.insert(all.mesh.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const Triangle& t : mesh.triangles) all.mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    all.solidOf.resize(all.mesh.triangles.size(), solid);
  }
  all.scale = surface::scaleToOne(all.mesh.vertices);
  for (Vector3& vertex : all.mesh.vertices) vertex *= all.scale;
}

/// Throws `Error` for a solid that is so small, beside the greatest coordinate, that cuts are not accurate to a
/// thousandth of its size.
void requireSimilarSizes(const std::vector<MeshSolid>& solids, double scale) {
  for (const MeshSolid& solid : solids) {
    const double size = boundingBox(*solid.mesh).sizes().norm();
    if (size * scale >= kLeastShareOfCoordinates) continue;
    throw Error(ErrorKind::mesh, "",
                detail::messageOf("the mesh ", solid.mesh->name, " has the size ", size,
                                  ", which rounding spoils beside coordinates of ", 1 / scale,
                                  "; combine solids of more similar sizes, near the origin"));
  }
}

/// Throws `Error` if the arrays for all solids would not fit into memory or their indices into 32 bits.
void requireSize(const std::vector<MeshSolid>& solids) {
  std::size_t vertices = 0, triangles = 0;
  for (const MeshSolid& solid : solids) {
    vertices += solid.mesh->vertices.size();
    triangles += solid.mesh->triangles.size();
  }
  constexpr double kBytesPerTriangle = 700;
  if (vertices > std::numeric_limits<std::uint32_t>::max() || triangles > bvh::Hierarchy::kMaxTriangles)
    throw Error(ErrorKind::limit, "", "the meshes have too many triangles to combine them; simplify them first");
  requireMemory("combining " + std::to_string(triangles) + " triangles", kBytesPerTriangle * double(triangles),
                "simplify the meshes first");
}

void findPartners(Arrangement& all, const std::vector<MeshSolid>& solids, const Progress& progress) {
  const bvh::Hierarchy hierarchy(all.mesh, boundingBox(all.mesh));
  Crossings crossings = surface::findCrossings(hierarchy, kMostCrossings, kReach, progress);
  if (!crossings.complete)
    throw Error(ErrorKind::limit, "", "more than 20 million pairs of triangles cross; simplify the meshes first");
  std::erase_if(crossings.found, [&](const Crossing& crossing) {
    const std::uint32_t solid = all.solidOf[crossing.triangles[0]];
    return solid == all.solidOf[crossing.triangles[1]] && solids[solid].hasOrientedTriangles();
  });
  all.firstOf.assign(all.mesh.triangles.size() + 1, 0);
  for (const Crossing& crossing : crossings.found)
    for (const std::uint32_t triangle : crossing.triangles) ++all.firstOf[triangle + 1];
  for (std::size_t t = 0; t < all.mesh.triangles.size(); ++t) all.firstOf[t + 1] += all.firstOf[t];
  all.partners.resize(2 * crossings.found.size());
  std::vector<std::size_t> next(all.firstOf.begin(), all.firstOf.end() - 1);
  for (const Crossing& crossing : crossings.found) {
    const auto [one, other] = crossing.triangles;
    all.partners[next[one]++] = other;
    all.partners[next[other]++] = one;
  }
}

/// Returns where the edge between two corners with heights of different signs crosses the plane of height 0. The result
/// is the same for both triangles that share the edge, because it does not depend on the order of the corners.
Vector3 crossingOf(const Corners& corners, const std::array<double, 3>& heights, const Triangle& indices, int k) {
  int from = k, to = (k + 1) % 3;
  if (indices[from] > indices[to]) std::swap(from, to);
  return corners[from] + (corners[to] - corners[from]) * (heights[from] / (heights[from] - heights[to]));
}

/// Cuts along the intersection of the triangle's plane with another triangle or, if the other one lies in this plane,
/// along its edges.
void cutBy(TriangleCutter& cutter, const bvh::TriangleFrame& frame, const Corners& other, const Triangle& indices) {
  std::array<double, 3> heights;
  int inPlane = 0;
  for (int k = 0; k < 3; ++k) {
    heights[k] = frame.normal.dot(other[k] - frame.origin);
    if (std::abs(heights[k]) <= kSnapped) heights[k] = 0, ++inPlane;
  }
  if (inPlane == 3) {
    for (int k = 0; k < 3; ++k) cutter.cut(other[k], other[(k + 1) % 3]);
    return;
  }
  std::vector<Vector3> ends;
  for (int k = 0; k < 3; ++k) {
    if (heights[k] == 0) ends.push_back(other[k]);
    if (heights[k] * heights[(k + 1) % 3] < 0) ends.push_back(crossingOf(other, heights, indices, k));
  }
  if (ends.size() != 2) return;
  const bvh::TriangleFrame otherFrame = bvh::makeFrame(other, 0);
  if (otherFrame.apexAcross > (ends[1] - ends[0]).norm())
    cutter.cut(ends[0], ends[1], otherFrame.normal);
  else
    cutter.cut(ends[0], ends[1]);
}

/// A convex piece of a triangle, or a whole one.
struct Piece {
  std::uint32_t triangle;
  Vector3 middle, normal;
  double width;                       ///< distance of the middle from the nearest side
  std::vector<Vector3> corners = {};  ///< empty for a whole triangle
};

double distanceToSides(std::span<const Vector3> corners, const Vector3& x) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector3& a = corners[i];
    const Vector3& b = corners[(i + 1) % corners.size()];
    least = std::min(least, (a + bvh::closestParameter(x, a, b) * (b - a) - x).norm());
  }
  return least;
}

Piece pieceOf(std::uint32_t triangle, const bvh::TriangleFrame& frame, std::span<const Vector3> corners) {
  Vector3 middle = Vector3::Zero();
  for (const Vector3& corner : corners) middle += corner;
  middle /= static_cast<double>(corners.size());
  return {.triangle = triangle, .middle = middle, .normal = frame.normal, .width = distanceToSides(corners, middle)};
}

/// Returns the width of a convex polygon in a plane: the least distance between two parallel lines around it.
double widthOf(std::span<const Vector3> corners, const Vector3& normal) {
  double width = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector3 side = corners[(i + 1) % corners.size()] - corners[i];
    if (!(side.norm() > 0)) continue;
    const Vector3 inward = normal.cross(side).normalized();
    double height = 0;
    for (const Vector3& corner : corners) height = std::max(height, inward.dot(corner - corners[i]));
    width = std::min(width, height);
  }
  return width;
}

/// Appends the pieces of a triangle. Triangles without area have none, because their edges belong to others as well.
void addPieces(const Arrangement& all, std::uint32_t triangle, std::vector<Piece>& pieces) {
  const Corners corners = all.cornersOf(triangle);
  const bvh::TriangleFrame frame = bvh::makeFrame(corners, triangle);
  if (!bvh::hasArea(frame)) return;
  // In random order, the expected number of pieces grows little faster than that of the crossings.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  for (const std::uint32_t partner : all.partnersOf(triangle))
    order.emplace_back(detail::Random(triangle, partner).next(), partner);
  std::ranges::sort(order);
  TriangleCutter cutter(frame);
  for (const auto& [key, partner] : order) cutBy(cutter, frame, all.cornersOf(partner), all.mesh.triangles[partner]);
  if (!cutter.isCut()) {
    pieces.push_back(pieceOf(triangle, frame, corners));
    return;
  }
  cutter.forEachPiece([&](std::span<const Vector3> polygon) {
    if (!(widthOf(polygon, frame.normal) > kNarrow)) return;
    pieces.push_back(pieceOf(triangle, frame, polygon));
    pieces.back().corners.assign(polygon.begin(), polygon.end());
  });
}

/// For the two sides of each piece: true if the side is inside one solid.
struct Sides {
  std::vector<char> front, behind;
};

/// Finds on which sides of pieces a solid lies.
class SideFinder {
 public:
  SideFinder(const Arrangement& all, const MeshSolid& solid, std::uint32_t number)
      : all_(all), solid_(solid), number_(number) {
    const Box& box = solid.distance->source().box;
    const Vector3 margin = Vector3::Constant(0.01 * box.sizes().norm() + kSnapped / all.scale);
    around_ = Box(box.min() - margin, box.max() + margin);
    isInsideAround_ = (*solid.distance)(around_.max() + margin) < 0;
  }

  Sides find(std::span<const Piece> pieces) const {
    return solid_.hasOrientedTriangles() ? ofMiddles(pieces) : ofProbes(pieces);
  }

 private:
  std::vector<double> distancesAt(std::vector<Vector3> points) const {
    for (Vector3& point : points) point /= all_.scale;
    std::vector<double> distances(points.size());
    (*solid_.distance)(points, distances);
    return distances;
  }

  /// Takes the side of each piece's middle. Pieces that lie in the solid's surface have its triangles' sides.
  Sides ofMiddles(std::span<const Piece> pieces) const {
    Sides sides{std::vector<char>(pieces.size(), isInsideAround_), std::vector<char>(pieces.size(), isInsideAround_)};
    std::vector<std::size_t> near;
    std::vector<Vector3> points;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (all_.solidOf[pieces[i].triangle] == number_) {
        sides.front[i] = 0;
        sides.behind[i] = 1;
      } else if (around_.contains(pieces[i].middle / all_.scale)) {
        near.push_back(i);
        points.push_back(pieces[i].middle);
      }
    }
    const std::vector<double> distances = distancesAt(std::move(points));
    for (std::size_t k = 0; k < near.size(); ++k) {
      const std::size_t i = near[k];
      if (std::abs(distances[k]) * all_.scale > kCoincident) {
        sides.front[i] = sides.behind[i] = distances[k] < 0;
      } else {
        sides.front[i] = sides.behind[i] = 0;
        const bool isAligned = normalNear(pieces[i].middle).dot(pieces[i].normal) > 0;
        (isAligned ? sides.behind : sides.front)[i] = 1;
      }
    }
    return sides;
  }

  Vector3 normalNear(const Vector3& x) const {
    const std::uint32_t triangle = solid_.distance->closestPoint(x / all_.scale).triangle;
    return bvh::makeFrame(cornersOf(*solid_.mesh, solid_.mesh->triangles[triangle]), triangle).normal;
  }

  /// Takes the sides of two points beside each piece's middle, closer to it than the piece is wide.
  Sides ofProbes(std::span<const Piece> pieces) const {
    constexpr double kShare = 1e-3, kLeast = 0x1p-40;
    std::vector<Vector3> points;
    for (const Piece& piece : pieces) {
      const double away = std::max(kShare * piece.width, kLeast);
      points.push_back(piece.middle + away * piece.normal);
      points.push_back(piece.middle - away * piece.normal);
    }
    const std::vector<double> distances = distancesAt(std::move(points));
    Sides sides;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      sides.front.push_back(distances[2 * i] < 0);
      sides.behind.push_back(distances[2 * i + 1] < 0);
    }
    return sides;
  }

  const Arrangement& all_;
  const MeshSolid& solid_;
  std::uint32_t number_;
  Box around_;  ///< holds the solid's surface; what lies beyond is on one side of it
  bool isInsideAround_ = false;
};

/// The pieces of some triangles that bound the result, with the outside in front.
struct KeptPieces {
  std::vector<std::pair<std::uint32_t, bool>> triangles;  ///< whole ones, and whether they are to be reversed
  std::vector<Corners> parts;                             ///< of cut triangles
};

void addParts(const Piece& piece, bool isReversed, std::vector<Corners>& parts) {
  for (std::size_t i = 1; i + 1 < piece.corners.size(); ++i) {
    Corners corners = {piece.corners[0], piece.corners[i], piece.corners[i + 1]};
    if (isReversed) std::swap(corners[1], corners[2]);
    if ((corners[1] - corners[0]).cross(corners[2] - corners[0]).squaredNorm() > 0) parts.push_back(corners);
  }
}

KeptPieces keptOf(const Arrangement& all, const std::vector<SideFinder>& solids, const BooleanTree& tree,
                  std::size_t first, std::size_t count) {
  std::vector<Piece> pieces;
  for (std::size_t t = first; t < first + count; ++t) addPieces(all, static_cast<std::uint32_t>(t), pieces);
  std::vector<Sides> sides;
  for (const SideFinder& solid : solids) sides.push_back(solid.find(pieces));
  KeptPieces kept;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const bool front = tree.contains([&](std::uint32_t solid) { return sides[solid].front[i] != 0; });
    const bool behind = tree.contains([&](std::uint32_t solid) { return sides[solid].behind[i] != 0; });
    if (front == behind) continue;
    if (pieces[i].corners.empty())
      kept.triangles.emplace_back(pieces[i].triangle, front);
    else
      addParts(pieces[i], front, kept.parts);
  }
  return kept;
}

/// Makes a mesh of the kept pieces, in the coordinates of the solids. Whole triangles share their vertices.
TriangleMesh meshOf(const Arrangement& all, const std::vector<KeptPieces>& chunks) {
  constexpr std::uint32_t kUnused = ~std::uint32_t{0};
  TriangleMesh result;
  std::vector<std::uint32_t> numbers(all.mesh.vertices.size(), kUnused);
  const auto add = [&](const Vector3& vertex) {
    result.vertices.push_back(vertex / all.scale);
    return static_cast<std::uint32_t>(result.vertices.size() - 1);
  };
  for (const KeptPieces& kept : chunks) {
    for (const auto& [triangle, isReversed] : kept.triangles) {
      Triangle corners = all.mesh.triangles[triangle];
      if (isReversed) std::swap(corners[1], corners[2]);
      for (std::uint32_t& corner : corners) {
        if (numbers[corner] == kUnused) numbers[corner] = add(all.mesh.vertices[corner]);
        corner = numbers[corner];
      }
      result.triangles.push_back(corners);
    }
    for (const Corners& corners : kept.parts) {
      // A braced list is evaluated from left to right.
      const Triangle triangle = {add(corners[0]), add(corners[1]), add(corners[2])};
      result.triangles.push_back(triangle);
    }
  }
  return result;
}

void requirePieces(const std::vector<KeptPieces>& chunks) {
  constexpr double kBytesPerPiece = 700;
  double count = 0;
  for (const KeptPieces& kept : chunks) count += static_cast<double>(kept.triangles.size() + kept.parts.size());
  if (count == 0)
    throw Error(ErrorKind::mesh, "",
                "nothing is left of the meshes, so that there is no distance: let them overlap, or change their order");
  constexpr double kMost = bvh::Hierarchy::kMaxTriangles;
  if (count > kMost)
    throw Error(ErrorKind::limit, "", "the meshes cut each other into too many pieces; simplify them first");
  requireMemory("the exact distance of " + std::to_string(static_cast<std::uint64_t>(count)) + " pieces",
                kBytesPerPiece * count, "simplify the meshes first");
}

}  // namespace

TriangleMesh boundaryOf(const std::vector<MeshSolid>& solids, const BooleanTree& tree, const Progress& progress) {
  requireSize(solids);
  Arrangement all;
  join(all, solids);
  requireSimilarSizes(solids, all.scale);
  findPartners(all, solids, progress);
  const std::size_t triangles = all.mesh.triangles.size();
  std::vector<SideFinder> finders;
  for (std::uint32_t solid = 0; solid < solids.size(); ++solid) finders.emplace_back(all, solids[solid], solid);
  std::vector<KeptPieces> chunks(detail::chunksOf(triangles, kTrianglesPerChunk));
  detail::forEachChunk(triangles, kTrianglesPerChunk, progress, "cutting the surfaces",
                       [&](std::size_t chunk, std::size_t first, std::size_t count) {
                         chunks[chunk] = keptOf(all, finders, tree, first, count);
                       });
  requirePieces(chunks);
  return meshOf(all, chunks);
}

}  // namespace hpsdf::combine
