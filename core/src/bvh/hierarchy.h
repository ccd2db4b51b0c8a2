#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bvh/triangle_frame.h"
#include "bvh/triangle_tree.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf::bvh {

/// Throws `Error` of kind `mesh` unless the mesh has from 1 to `Hierarchy::kMaxTriangles` triangles, valid vertex
/// indices, and finite coordinates up to `kLargestCoordinate`.
void requireSurface(const TriangleMesh& mesh);

/// The triangle of a mesh that is nearest to a query point.
struct Nearest {
  std::uint32_t triangleRef = 0;  ///< refers to the triangle, see `Hierarchy::frameAt`
  FramePoint point;               ///< the query point's position relative to the triangle
};

constexpr int kPacket = 16;      ///< greatest number of query points that search the hierarchy together, in SIMD lanes
constexpr int kSmallPacket = 8;  ///< the number of lanes for packets that are not larger

/// A node of the hierarchy: the oriented boxes of four children in single precision, 256 bytes. The boxes are in
/// local coordinates, in which the mesh lies in [-1, 1]³.
struct alignas(64) Node {
  enum Field { center = 0, axes = 3, half = 12, fields = 15 };
  float field[fields][kWidth];
  /// For each box: the index of a child node; or the index of a block of triangles, with the bit kBlockBit set;
  /// or kEmpty for an unused box, which no search visits.
  std::uint32_t child[kWidth];
};
constexpr std::uint32_t kBlockBit = 0x80000000;
constexpr std::uint32_t kEmpty = 0x7fffffff;

/// The limit of squared distances when a search in single precision begins. All squared distances to the mesh are below
/// this limit; the squared distances to the boxes of unused children are above it.
constexpr float kOutOfReach = 1e33f;

/// Up to four triangles in single precision and local coordinates, with the fields of `TriangleFrame` except the
/// normal. Unused places repeat the last triangle.
struct alignas(32) Block {
  enum Field {
    origin = 0,
    along = 3,
    across = 6,
    length = 9,
    apexAlong,
    apexAcross,
    inverseLeft,
    inverseRight,
    fields
  };
  float field[fields][kWidth];
  std::uint32_t first;  ///< position of the first triangle in the order of the tree; the others follow it
  std::uint32_t count;
};

/// An array with uninitialised elements. The threads that fill it are the first to touch its memory pages. The
/// operating system therefore places each page in the memory closest to its thread. The array is not cleared first.
template <typename T>
class Array {
 public:
  Array() = default;
  explicit Array(std::size_t size) : elements_(std::make_unique_for_overwrite<T[]>(size)), size_(size) {}

  std::size_t size() const { return size_; }
  T& operator[](std::size_t i) { return elements_[i]; }
  const T& operator[](std::size_t i) const { return elements_[i]; }
  operator std::span<const T>() const { return {elements_.get(), size_}; }

 private:
  std::unique_ptr<T[]> elements_;
  std::size_t size_ = 0;
};

/// Bounding-volume hierarchy of oriented boxes (Gottschalk et al. 1996) over triangles, with four children per node.
///
/// The boxes and triangles in nodes and blocks are in single precision. A search uses them only to skip triangles. Its
/// bounds allow for rounding: it never skips a triangle that may be the nearest. It computes the squared distances of
/// the other triangles in double precision and returns the nearest one; among equal distances, the least index in the
/// mesh wins. The result does not depend on the tree, on the triangles from which the search starts, or on the
/// instruction set.
class Hierarchy {
 public:
  Hierarchy() = default;

  /// Builds the hierarchy of a mesh that meets the conditions of `requireSurface`; `box` is the mesh's bounding box.
  Hierarchy(const TriangleMesh& mesh, const Box& box);

  static constexpr std::size_t kMaxTriangles = std::size_t{1} << 28;

  /// Returns the triangle that `triangleRef` refers to: triangle `triangleRef % kWidth` of block `triangleRef /
  /// kWidth`.
  const TriangleFrame& frameAt(std::uint32_t triangleRef) const { return frames_[slotAt(triangleRef)]; }

  std::span<const Node> nodes() const { return nodes_; }
  std::span<const Block> blocks() const { return blocks_; }

  /// Returns the slot of a triangle: its position in the order of the hierarchy. The triangles of a block have
  /// successive slots.
  std::uint32_t slotAt(std::uint32_t triangleRef) const {
    return blocks_[triangleRef / kWidth].first + triangleRef % kWidth;
  }

  // Frames and triangles are sorted in the order of the hierarchy. Therefore, neighbouring triangles on the surface are
  // usually close in memory.
  std::span<const TriangleFrame> frames() const { return frames_; }
  std::span<const Triangle> triangles() const { return triangles_; }  ///< three indices into `vertices()` each
  std::span<const Vector3> vertices() const { return vertices_; }     ///< vertices in use, in the order of first use

  std::size_t bytes() const;

  /// Converts x to the local coordinates that nodes and blocks use.
  Vector3 local(const Vector3& x) const { return (x - center_) * scale_; }
  double scale() const { return scale_; }

 private:
  /// Fills the members triangles_ and vertices_ from the mesh, in the order of the tree.
  void sortSurface(const TriangleMesh& mesh, const std::vector<std::uint32_t>& order);
  /// Fills a block with the triangles at the positions `begin` to `end` - 1 in the order of the hierarchy.
  void fill(Block& block, std::uint32_t begin, std::uint32_t end) const;

  Array<TriangleFrame> frames_;
  Array<Node> nodes_;
  Array<Block> blocks_;
  std::vector<Triangle> triangles_;
  std::vector<Vector3> vertices_;
  Vector3 center_;    ///< local coordinates = (x - center_)·scale_
  double scale_ = 1;  ///< 2 / longest side of the mesh's bounding box
};

}  // namespace hpsdf::bvh
