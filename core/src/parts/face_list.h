#pragma once
// The triangles of a mesh that need not be in memory.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"
#include "util/mapped_file.h"

namespace hpsdf::parts {

/// The vertices and triangles of a mesh, by index.
class FaceList {
 public:
  virtual ~FaceList() = default;
  virtual std::string name() const = 0;
  virtual std::size_t vertices() const = 0;
  virtual std::size_t faces() const = 0;
  virtual Vector3 vertex(std::size_t index) const = 0;
  /// Returns the indices of a triangle's corners, which may be out of range.
  virtual Triangle face(std::size_t index) const = 0;
};

/// A mesh in memory, which must outlive this object.
class FacesInMemory : public FaceList {
 public:
  explicit FacesInMemory(const TriangleMesh& mesh) : mesh_(mesh) {}
  std::string name() const override { return mesh_.name; }
  std::size_t vertices() const override { return mesh_.vertices.size(); }
  std::size_t faces() const override { return mesh_.triangles.size(); }
  Vector3 vertex(std::size_t index) const override { return mesh_.vertices[index]; }
  Triangle face(std::size_t index) const override { return mesh_.triangles[index]; }

 private:
  const TriangleMesh& mesh_;
};

/// The mesh of a binary PLY file, which is mapped into memory: vertices that begin anywhere with coordinates x, y and z
/// of type float or double, and then faces with three vertex indices and nothing else.
class FacesOfPly : public FaceList {
 public:
  /// Returns the faces of a file, or null for a file of another layout or format. Whether all faces are triangles is
  /// known only when `face` reads them. Throws `Error` (of the kind `file`) for a file that cannot be read, is no PLY
  /// file although its name ends in .ply, or is shorter than its header promises.
  static std::unique_ptr<const FacesOfPly> open(const std::filesystem::path& file, const Progress& progress);

  std::string name() const override { return name_; }
  std::size_t vertices() const override { return vertices_; }
  std::size_t faces() const override { return faces_; }
  Vector3 vertex(std::size_t index) const override;
  /// Throws `Error` (of the kind `mesh`) for a face that is not a triangle.
  Triangle face(std::size_t index) const override;

 private:
  explicit FacesOfPly(const std::filesystem::path& file) : name_(file.filename().string()), file_(file) {}

  std::string name_;
  detail::MappedFile file_;
  std::size_t vertices_ = 0, faces_ = 0;
  std::size_t firstVertex_ = 0, vertexBytes_ = 0, firstFace_ = 0;  ///< in bytes
  std::size_t coordinate_ = 0;                                     ///< bytes from a vertex to its x
  bool isSingle_ = false;                                          ///< coordinates are of type float
};

}  // namespace hpsdf::parts
