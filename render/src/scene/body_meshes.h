#pragma once
// The meshes of a body renderer. They are checked, and have normals for shading.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/render/bodies.h"

namespace hpsdf::render {

using Triangle = std::array<std::uint32_t, 3>;

/// The normals at a triangle's three corners.
using CornerNormals = std::array<Eigen::Vector3f, 3>;

class BodyMesh {
 public:
  /// Throws the same errors as `makeCpuBodyRenderer`.
  explicit BodyMesh(TriangleMesh mesh);

  /// Moves vertices of a mesh. Throws the same errors as `BodyRenderer::moveVertices`.
  void moveVertices(std::span<const Vector3> vertices);

  const std::vector<Vector3>& vertices() const { return mesh_.vertices; }
  const std::vector<Triangle>& triangles() const { return mesh_.triangles; }
  const Box& box() const { return box_; }

  /// The unit normal for shading, at the point of a triangle with the given barycentric coordinates. The normal points
  /// to the side from which the corners run counter-clockwise.
  Vector3 normal(std::uint32_t triangle, const Vector3& barycentric) const;

 private:
  void findNormals();

  TriangleMesh mesh_;
  Box box_;
  // The triangle corners at vertex v are corners_[firstCorner_[v]] to corners_[firstCorner_[v + 1] - 1]. Each
  // entry of corners_ is 3 · triangle + 0, 1 or 2.
  std::vector<std::uint32_t> firstCorner_, corners_;
  std::vector<CornerNormals> normals_;
};

class BodyMeshes {
 public:
  /// Throws the same errors as `makeCpuBodyRenderer`.
  explicit BodyMeshes(std::vector<TriangleMesh> meshes);

  std::size_t size() const { return meshes_.size(); }
  const BodyMesh& operator[](std::size_t mesh) const { return meshes_[mesh]; }

  /// Moves vertices of a mesh. Throws the same errors as `BodyRenderer::moveVertices`.
  void moveVertices(std::size_t mesh, std::span<const Vector3> vertices);

  /// A box that contains the bodies. Throws the same errors as `BodyRenderer::bounds`.
  Box bounds(std::span<const Body> bodies) const;

 private:
  std::vector<BodyMesh> meshes_;
};

/// Throws `Error` for more than 2^26 triangles.
void checkTriangleCount(std::size_t triangles);

}  // namespace hpsdf::render
