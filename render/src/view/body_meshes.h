#pragma once
// What both renderers of bodies know of their meshes: checked, and with the normals that light them.

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
  /// Throws as `makeCpuBodyRenderer` does.
  explicit BodyMesh(TriangleMesh mesh);

  void moveVertices(std::span<const Vector3> vertices);

  const std::vector<Vector3>& vertices() const { return mesh_.vertices; }
  const std::vector<Triangle>& triangles() const { return mesh_.triangles; }
  const Box& box() const { return box_; }

  /// Unit, where the corners have these weights; on the outer side of a triangle that is counter-clockwise from there.
  Vector3 normal(std::uint32_t triangle, const Vector3& weights) const;

 private:
  void findNormals();

  TriangleMesh mesh_;
  Box box_;
  // the corners (3 · triangle + 0, 1 or 2) at a vertex v: aroundVertex_[firstAround_[v]] up to firstAround_[v + 1]
  std::vector<std::uint32_t> firstAround_, aroundVertex_;
  std::vector<CornerNormals> normals_;
};

class BodyMeshes {
 public:
  explicit BodyMeshes(std::vector<TriangleMesh> meshes);

  std::size_t size() const { return meshes_.size(); }
  const BodyMesh& operator[](std::size_t mesh) const { return meshes_[mesh]; }

  /// As those of `BodyRenderer`.
  void moveVertices(std::size_t mesh, std::span<const Vector3> vertices);
  Box bounds(std::span<const Body> bodies) const;

 private:
  std::vector<BodyMesh> meshes_;
};

/// Throws `Error` for more triangles of all meshes than are taken.
void checkTriangleCount(std::size_t triangles);

/// Throws `Error` for a camera or a size that `BodyRenderer::view` does not take.
void checkBodyView(const Camera& camera, int width, int height);

/// How far along forward the farthest corner of a box is from the eye; above 0, whatever the box.
double farthestDepth(const Camera& camera, const Box& box);

/// The least depth that is seen, as `BodyRenderer::view` says.
double leastDepth(const Camera& camera, double farthest);

BodyBuffers emptyBodyBuffers(int width, int height);

/// What is nearer than what the buffers show replaces it.
void addBodies(const BodyBuffers& bodies, ViewBuffers& buffers);

/// Parallel rays moved back to start before the box; in perspective the camera as it is.
Camera startingBefore(const Box& box, const Camera& camera);

}  // namespace hpsdf::render
