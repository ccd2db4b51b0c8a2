#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "bvh/triangle_frame.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"
#include "util/grouping.h"

namespace hpsdf::contouring {

/// The positions of the corners of a triangle.
using Corners = std::array<Vector3, 3>;

/// A change of a mesh: some triangles are replaced by others, of which there are as many or fewer.
struct Edit {
  std::vector<std::uint32_t> removed;  ///< indices of triangles
  std::vector<Triangle> added;
  std::optional<std::uint32_t> vertex;  ///< a corner of triangles that are added, and of no others, which moves
  Vector3 position = Vector3::Zero();   ///< the vertex's new position
};

/// A point of the surface that a mesh approximates.
struct SurfacePoint {
  Vector3 position;
  std::uint32_t triangle;  ///< the triangle of the mesh to which it is nearest
};

/// A mesh that is changed in many places at once, with the triangles at each vertex.
class EditedMesh {
 public:
  EditedMesh(std::vector<Vector3> vertices, std::vector<Triangle> triangles);

  /// Keeps points of the surface from now on.
  void setPoints(std::vector<SurfacePoint> points);
  bool hasPoints() const { return !points_.empty(); }

  std::span<const Vector3> vertices() const { return vertices_; }
  std::span<const Triangle> triangles() const { return triangles_; }

  std::span<const std::uint32_t> trianglesAt(std::uint32_t vertex) const { return trianglesAt_[vertex]; }

  /// Returns true for a vertex on an edge of one triangle only, or on one of more than two.
  bool isAtBoundary(std::uint32_t vertex) const { return isAtBoundary_[vertex]; }

  /// Calls visit(position) for each point of the surface that is nearest to a triangle.
  template <typename Visit>
  void forEachPointOf(std::uint32_t triangle, const Visit& visit) const {
    for (const std::uint32_t i : pointsOf_[triangle]) visit(points_[i].position);
  }

  Corners corners(std::uint32_t triangle) const {
    const Triangle& t = triangles_[triangle];
    return {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]};
  }

  /// Returns the corners of a triangle after an edit.
  Corners cornersAfter(const Edit& edit, const Triangle& triangle) const;

  /// Makes edits, which have no triangle in common. The points of triangles that an edit removes become those of the
  /// nearest triangle that it adds.
  void make(std::span<const Edit> edits);

  /// Removes vertices that no triangle uses, and returns the mesh.
  TriangleMesh finish() &&;

 private:
  void movePoints(const Edit& edit);
  void listTriangles();
  void listPoints();

  std::vector<Vector3> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<SurfacePoint> points_;
  detail::Grouping trianglesAt_, pointsOf_;
  std::vector<bool> isAtBoundary_;
};

/// Triangles whose distances from many points are needed.
class NearTriangles {
 public:
  explicit NearTriangles(std::span<const Corners> triangles);

  /// Returns the place of the triangle that is nearest to a point, and the squared distance.
  std::pair<std::size_t, double> nearestTo(const Vector3& point) const;

  /// Raises a squared distance to that of a point from the nearest triangle.
  void raise(double& squared, const Vector3& point) const;

 private:
  std::vector<bvh::TriangleFrame> frames_;
};

}  // namespace hpsdf::contouring
