#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

struct DistanceOnDiskOptions {
  /// `automatic`, which tests that pseudonormals tell the sign and refuses a mesh where they do not, or `pseudonormal`,
  /// which trusts them.
  InsideTest insideTest = InsideTest::automatic;
  /// Most triangles of a part, unless they share a cell of a grid of 128³ cells around the mesh; 0 for a 256th of the
  /// mesh, or 65,536 if that is more.
  std::size_t facesOfPart = 0;
  /// Bytes of parts that stay mapped into memory, at most half of `allowedMemory`; 0 for that. Each thread may use one
  /// part more.
  std::size_t memory = 0;
  int threads = 0;  ///< greatest number of threads while parts are made, 0 for all
};

/// Exact signed distance to a triangle mesh that need not fit into memory. At finite points it equals `ExactDistance`
/// to the bit, where that takes the sign from pseudonormals.
///
/// The mesh is divided by place into parts. Each part has a hierarchy of its own triangles and of those that meet their
/// box, so that all connectivity around its own triangles is at hand. The parts are written to files, some 150 bytes
/// for each triangle. A query maps into memory the parts that may hold the nearest triangle, nearest first; parts that
/// no query has used for longest are unmapped where the parts exceed the memory. While parts are made, memory is needed
/// for one part (some 300 bytes for each of its triangles), for 64 kB of each part's list, for four bytes a triangle
/// and, for a mesh in memory, the mesh. A triangle that is large beside the parts makes its part large.
///
/// The parts lie in a folder of their own within the given folder, named by the mesh's fingerprint. The folder of parts
/// appears whole or not at all, and is used again for the same mesh: by another construction, or by several processes
/// at once. It may be removed when no process uses it.
///
/// Objects are const and thread-safe.
class DistanceOnDisk {
 public:
  /// Divides a mesh in memory, to which no reference is kept. Throws `Error` of the kind `mesh`
  /// - for a mesh without triangles, with indices out of range or with coordinates that are not finite;
  /// - for triangles that have no area, and vertices of equal position or that no triangle uses: such a mesh must be
  ///   cleaned first (`hpsdf::cleaned`, `hpsdf mesh --repair`);
  /// - for the automatic inside test, if the mesh has holes, intersects itself, has several components or a negative
  ///   volume, or edges too sharp for normals.
  /// Throws `Error` of the kind `option` for another inside test, of the kind `limit` where the disk has not enough
  /// free space or a part does not fit into memory, and of the kind `file` if a file cannot be written or read. Throws
  /// `Cancelled` when `progress` says so.
  DistanceOnDisk(const TriangleMesh& mesh, const std::filesystem::path& folder,
                 const DistanceOnDiskOptions& options = {}, const Progress& progress = {});
  /// Divides the mesh of a PLY file of which `isMappable` is true, without reading it into memory. Throws as the other
  /// constructor does, also for faces that are not triangles.
  DistanceOnDisk(const std::filesystem::path& file, const std::filesystem::path& folder,
                 const DistanceOnDiskOptions& options = {}, const Progress& progress = {});
  /// Opens the folder of parts that another object has made (`folder()`), with the same inside test. Throws `Error` (of
  /// the kind `file`) if it is missing or damaged.
  static DistanceOnDisk open(const std::filesystem::path& parts, const DistanceOnDiskOptions& options = {});
  ~DistanceOnDisk();
  DistanceOnDisk(DistanceOnDisk&&) noexcept;
  DistanceOnDisk& operator=(DistanceOnDisk&&) noexcept;

  /// Returns true for a binary little-endian PLY file that has nothing but vertex indices for its faces. Throws `Error`
  /// (of the kind `file`) for a PLY file that cannot be read.
  static bool isMappable(const std::filesystem::path& file);

  /// Evaluates the signed distance at many points, which should be close to each other. Both spans must have the same
  /// length. Throws `Error` (of the kind `file`) if a part is damaged.
  void operator()(std::span<const Vector3> points, std::span<double> out) const;

  bool hasGradients() const { return true; }
  /// As `ExactDistance::withGradients`. Throws `Error` as `operator()` does.
  void withGradients(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> gradients) const;

  const Source& source() const;
  std::size_t bytes() const;             ///< most bytes of parts that are mapped into memory at once
  std::uint64_t bytesOnDisk() const;     ///< of all parts
  std::size_t parts() const;             ///< number of parts
  std::uint64_t mappings() const;        ///< how many times a part has been mapped into memory
  std::filesystem::path folder() const;  ///< the folder of the parts

 private:
  struct Data;
  explicit DistanceOnDisk(std::unique_ptr<const Data> data);
  std::unique_ptr<const Data> data_;
};

}  // namespace hpsdf
