#include "contour/dual_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "contour/cells/bisection.h"
#include "contour/cells/triangle_errors.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr std::uint32_t kNoPoint = 0xffffffff;

/// Makes the polygons of a dual mesh and divides them into triangles.
class Polygons {
 public:
  Polygons(const ImplicitSurface& surface, const ContourOctree& octree, std::span<CrossedEdge> edges,
           const Sheets& sheets, std::vector<Vector3> vertices, const std::vector<bool>& fans, double accuracy)
      : surface_(surface), octree_(octree), edges_(edges), sheets_(sheets), fans_(fans), accuracy_(accuracy) {
    mesh_.vertices = std::move(vertices);
    if (!fans_.empty()) addFacePoints();
  }

  DualMesh make() {
    for (std::uint32_t e = 0; e < edges_.size(); ++e) {
      const std::vector<std::uint32_t>& ring = ringOf(e);
      if (!fans_.empty() && (fans_[e] || ring.size() > 4))
        addFan(e, ring);
      else if (ring.size() == 3)
        add(e, {ring[0], ring[1], ring[2]});
      else
        quads_.push_back({e, {ring[0], ring[1], ring[2], ring[3]}});
    }
    addQuads();
    return std::move(mesh_);
  }

 private:
  struct Quad {
    std::uint32_t edge;
    std::array<std::uint32_t, 4> corners;
  };

  void add(std::uint32_t edge, const Triangle& triangle) {
    mesh_.triangles.push_back(triangle);
    mesh_.edgeOfTriangle.push_back(edge);
  }

  std::uint32_t addVertex(const Vector3& point) {
    mesh_.vertices.push_back(point);
    return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
  }

  /// Adds a point for each link of a marked edge.
  void addFacePoints() {
    facePoints_.assign(sheets_.links().size(), kNoPoint);
    for (std::size_t n = 0; n < sheets_.links().size(); ++n) {
      const Link& link = sheets_.links()[n];
      if (fans_[link.edges[0]] || fans_[link.edges[1]]) facePoints_[n] = addVertex(pointOn(link));
    }
  }

  /// Returns a point of the face of a link: where the planes at both crossings meet in the face, or else a point of the
  /// surface near the middle between them. If other links share the face, returns the middle, so that straight lines
  /// separate them.
  Vector3 pointOn(const Link& link) const {
    const CrossedEdge &one = edges_[link.edges[0]], &other = edges_[link.edges[1]];
    const int axis = link.face.axis, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double a = one.normal[u], b = one.normal[v], c = other.normal[u], d = other.normal[v];
    const double right = one.normal.dot(one.point) - one.normal[axis] * one.point[axis];
    const double otherRight = other.normal.dot(other.point) - other.normal[axis] * other.point[axis];
    const double determinant = a * d - b * c;
    Vector3 point = (one.point + other.point) / 2;
    if (!link.isOnly) return point;
    const Box face = boxOf(octree_, link);
    if (std::abs(determinant) > 0.1) {
      Vector3 meeting = point;
      meeting[u] = (right * d - otherRight * b) / determinant;
      meeting[v] = (otherRight * a - right * c) / determinant;
      if (face.contains(meeting)) return bisected(surface_, face, meeting, accuracy_);
    }
    for (int step = 0; step < 4; ++step) {
      ValueAndGradient at;
      surface_.valuesAndGradients({&point, 1}, {&at, 1});
      at.gradient[axis] = 0;
      const double squared = at.gradient.squaredNorm();
      if (!(squared > 0.01)) break;
      point = (point - at.gradient * (at.value / squared)).cwiseMax(face.min()).cwiseMin(face.max());
    }
    return bisected(surface_, face, point, accuracy_);
  }

  /// Returns the corners of an edge's polygon, counter-clockwise as seen from outside.
  const std::vector<std::uint32_t>& ringOf(std::uint32_t e) {
    const CrossedEdge& edge = edges_[e];
    ring_.clear();
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t next = (i + 1) % 4;
      if (edge.cells[i] == edge.cells[next]) continue;
      ring_.push_back(sheets_.sheetAt(e, i));
      if (facePoints_.empty()) continue;
      const std::uint32_t point = facePoints_[sheets_.linkOf(e, edge.cells[i], edge.cells[next])];
      if (point != kNoPoint) ring_.push_back(point);
    }
    if (!edge.lowerInside) std::ranges::reverse(ring_);
    return ring_;
  }

  void addFan(std::uint32_t e, std::span<const std::uint32_t> ring) {
    const std::uint32_t center = addVertex(edges_[e].point);
    for (std::size_t i = 0; i < ring.size(); ++i) add(e, {center, ring[i], ring[(i + 1) % ring.size()]});
  }

  void addQuads() {
    std::vector<std::uint32_t> changed;
    for (std::uint32_t i = 0; i < quads_.size(); ++i)
      if (edges_[quads_[i].edge].polygon.isChanged) changed.push_back(i);
    chooseDiagonals(changed);
    for (const auto& [edge, c] : quads_) {
      if (edges_[edge].polygon.hasSecondDiagonal) {
        add(edge, {c[0], c[1], c[3]});
        add(edge, {c[1], c[2], c[3]});
      } else {
        add(edge, {c[0], c[1], c[2]});
        add(edge, {c[0], c[2], c[3]});
      }
    }
  }

  /// Returns the least cosine between the surface's normal at the quadrilateral's edge and the normals of its two
  /// triangles if it is divided between corners `k` and `k + 2`.
  double leastCosine(const Quad& quad, std::size_t k) const {
    const Vector3& outward = edges_[quad.edge].normal;
    const auto corner = [&](std::size_t i) -> const Vector3& { return mesh_.vertices[quad.corners[i % 4]]; };
    double least = 1;
    for (const std::size_t first : {k, k + 2}) {
      const Vector3 normal = (corner(first + 1) - corner(first)).cross(corner(first + 2) - corner(first));
      const double length = normal.norm();
      least = std::min(least, length > 0 ? normal.dot(outward) / length : -1);
    }
    return least;
  }

  /// Chooses the diagonals whose middles are nearer to the surface, but none that folds a quadrilateral over if the
  /// other one does not.
  void chooseDiagonals(std::span<const std::uint32_t> quads) {
    constexpr std::size_t kAtOnce = 256;
    detail::forEachChunk(quads.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
      std::array<Vector3, 2 * kAtOnce> points;
      std::array<double, 2 * kAtOnce> values;
      for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < 2; ++k) {
          const auto& corners = quads_[quads[first + i]].corners;
          points[2 * i + k] = (mesh_.vertices[corners[k]] + mesh_.vertices[corners[k + 2]]) / 2;
        }
      surface_.values(std::span(points).first(2 * count), std::span(values).first(2 * count));
      for (std::size_t i = 0; i < count; ++i) {
        const Quad& quad = quads_[quads[first + i]];
        const bool folds = leastCosine(quad, 0) < kFolded, otherFolds = leastCosine(quad, 1) < kFolded;
        edges_[quad.edge].polygon.hasSecondDiagonal =
            folds != otherFolds ? folds : std::abs(values[2 * i + 1]) < std::abs(values[2 * i]);
      }
    });
  }

  const ImplicitSurface& surface_;
  const ContourOctree& octree_;
  std::span<CrossedEdge> edges_;
  const Sheets& sheets_;
  const std::vector<bool>& fans_;
  double accuracy_;
  DualMesh mesh_;
  std::vector<std::uint32_t> facePoints_;  ///< by link: a vertex, or kNoPoint
  std::vector<std::uint32_t> ring_;
  std::vector<Quad> quads_;
};

}  // namespace

DualMesh makeDualMesh(const ImplicitSurface& surface, const ContourOctree& octree, std::span<CrossedEdge> edges,
                      const Sheets& sheets, std::vector<Vector3> vertices, const std::vector<bool>& fans,
                      double accuracy) {
  return Polygons(surface, octree, edges, sheets, std::move(vertices), fans, accuracy).make();
}

}  // namespace hpsdf::contouring
