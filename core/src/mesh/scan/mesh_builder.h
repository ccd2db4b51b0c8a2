#pragma once
// The mesh that a reader makes of a file.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hpsdf/triangle_mesh.h"
#include "mesh/scan/input.h"

namespace hpsdf::mesh {

/// Collects the vertices and faces that a reader finds in a file. Memory is taken as the file fills it, not as the file
/// promises: before arrays grow, their size is estimated from the share of the file that has been read.
class MeshBuilder {
 public:
  /// `input` is the file from which the mesh is read; it must outlive this object.
  explicit MeshBuilder(const Input& input);

  /// Tells how many vertices or triangles will come, each of which takes at least `bytes` bytes of the file. Throws
  /// `Error` if the rest of the file cannot hold so many.
  void expectVertices(std::uint64_t count, std::uint64_t bytes);
  void expectTriangles(std::uint64_t count, std::uint64_t bytes);

  /// Adds a vertex. Throws `Error` if there are as many as 32 bits can number, or if they exceed the memory.
  void addVertex(const Vector3& v) {
    if (mesh_.vertices.size() == mesh_.vertices.capacity()) growVertices();
    mesh_.vertices.push_back(v);
  }

  /// Adds a face whose corners are indices of vertices, from 0; a face with more than three corners is triangulated,
  /// and one with fewer is left out. The vertices may be added later. `line` is the line of the file where the face
  /// stands, for errors, or 0 if the file has no lines.
  void addFace(std::span<const std::uint32_t> corners, std::uint64_t line) {
    if (corners.size() == 3) return addTriangle({corners[0], corners[1], corners[2]}, line);
    addPolygon(corners, line);
  }
  void addTriangle(const Triangle& corners, std::uint64_t line) {
    ++faces_;
    const std::size_t known = mesh_.vertices.size();
    if (corners[0] >= known || corners[1] >= known || corners[2] >= known) return addLater(corners, line);
    if (mesh_.triangles.size() == mesh_.triangles.capacity()) growTriangles();
    mesh_.triangles.push_back(corners);
  }

  std::size_t vertices() const { return mesh_.vertices.size(); }

  /// Throws the error for the face that would be added next if it refers to a vertex that does not exist. `vertex` is
  /// that vertex's number, counted from 1 or, if it is negative, back from the last vertex.
  [[noreturn]] void refuseVertex(std::int64_t vertex, std::uint64_t line) const;

  /// Throws the error for the face that would be added next if one of its indices, which count from 0, is negative.
  [[noreturn]] void refuseNegative(std::int64_t index, std::uint64_t line) const;

  /// Returns the mesh, whose name is the path of the file. Throws `Error` if a face refers to a vertex that was not
  /// added.
  TriangleMesh finish();

 private:
  struct LaterFace {
    std::size_t firstCorner, corners;  ///< range in `laterCorners_`
    std::uint64_t number, line;
  };

  template <typename T>
  void grow(std::vector<T>& array, double& beginning) const;
  std::size_t arrayBytes() const;  ///< memory that the arrays take
  void growVertices();
  void growTriangles();
  void expect(std::uint64_t count, std::uint64_t bytes, const char* what) const;
  [[noreturn]] void refuseVertexOf(std::uint64_t face, std::int64_t vertex, std::uint64_t line) const;
  void addPolygon(std::span<const std::uint32_t> corners, std::uint64_t line);
  void addLater(std::span<const std::uint32_t> corners, std::uint64_t line);
  void addTriangulated(std::span<const std::uint32_t> corners);

  const Input& input_;
  TriangleMesh mesh_;
  /// Shares of the file before its first vertex and its first face; below 0 before these were read.
  double verticesBegin_ = -1, trianglesBegin_ = -1;
  std::uint64_t faces_ = 0;       ///< faces added, whatever their number of corners
  std::vector<LaterFace> later_;  ///< faces whose vertices were not known yet
  std::vector<std::uint32_t> laterCorners_;
  std::vector<Vector3> polygon_;  ///< positions of the corners of the face that is triangulated
};

}  // namespace hpsdf::mesh
