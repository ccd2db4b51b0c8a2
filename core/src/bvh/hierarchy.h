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

/// Throws `Error` (mesh) unless the mesh has at least one and at most `Hierarchy::kMaxTriangles` triangles, of vertices
/// that exist, and all coordinates are finite.
void requireSurface(const TriangleMesh& mesh);

/// The nearest triangle of a point.
struct Nearest {
  std::uint32_t triangleRef = 0;  ///< reference of the triangle, see `Hierarchy::frameAt`
  FramePoint point;               ///< the query point relative to that triangle's frame
};

constexpr int kPacket = 8;  ///< points of a packet

/// Four oriented boxes in single precision and local coordinates, which map the mesh into [-1, 1]³; 256 bytes.
struct alignas(64) Node {
  enum Field { center = 0, axes = 3, half = 12, fields = 15 };
  float field[fields][kWidth];
  /// The index of a node, the index of a block with kBlockBit set, or kEmpty, whose box no search reaches.
  std::uint32_t child[kWidth];
};
constexpr std::uint32_t kBlockBit = 0x80000000;
constexpr std::uint32_t kEmpty = 0x7fffffff;

/// A squared distance that exceeds those of all points for which the search uses single precision. The boxes of empty
/// children are still farther away.
constexpr float kOutOfReach = 1e33f;

/// Up to four triangles in single precision and local coordinates: the fields of `TriangleFrame` without the normal.
/// Unused lanes repeat the last triangle.
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
  std::uint32_t first;  ///< slot of the first triangle; the others follow it
  std::uint32_t count;
};

/// An array without initial values. Each thread touches memory first where it fills it, so that pages are placed near
/// that thread and no single thread has to clear them beforehand.
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

/// Bounding-volume hierarchy of oriented boxes (Gottschalk et al. 1996) over triangles, with four children a node.
///
/// Nodes and blocks only decide which triangles to skip. They are single precision, and every bound allows for its
/// rounding, so that no triangle that may be the nearest is skipped. Among the remaining triangles the answer is the
/// minimum by (squared distance in double, mesh index). It depends neither on the tree nor on the seeds of a search nor
/// on the instruction set.
class Hierarchy {
 public:
  Hierarchy() = default;

  /// Builds the hierarchy of a mesh that `requireSurface` accepts; `box` is the mesh's bounding box.
  Hierarchy(const TriangleMesh& mesh, const Box& box);

  static constexpr std::size_t kMaxTriangles = std::size_t{1} << 28;

  /// Returns the triangle with this reference: number `triangleRef % kWidth` of block `triangleRef / kWidth`.
  const TriangleFrame& frameAt(std::uint32_t triangleRef) const { return frames_[slotAt(triangleRef)]; }

  std::span<const Node> nodes() const { return nodes_; }
  std::span<const Block> blocks() const { return blocks_; }

  /// The slot of a triangle: its number in the hierarchy's order, in which the triangles of a block are adjacent.
  std::uint32_t slotAt(std::uint32_t triangleRef) const {
    return blocks_[triangleRef / kWidth].first + triangleRef % kWidth;
  }

  // Frames and triangles are indexed by slot: most neighbours on the surface are neighbours in memory.
  std::span<const TriangleFrame> frames() const { return frames_; }
  std::span<const Triangle> triangles() const { return triangles_; }  ///< as indices of `vertices`
  std::span<const Vector3> vertices() const { return vertices_; }     ///< vertices in use, in the order of first use

  std::size_t bytes() const;

  /// Converts x to the local coordinates in which nodes and blocks are stored.
  Vector3 local(const Vector3& x) const { return (x - center_) * scale_; }
  double scale() const { return scale_; }

 private:
  /// Fills triangles_ and vertices_ from the mesh, in the tree's order.
  void sortSurface(const TriangleMesh& mesh, const std::vector<std::uint32_t>& order);
  /// Fills a block with the triangles of slots [begin, end).
  void fill(Block& block, std::uint32_t begin, std::uint32_t end) const;

  Array<TriangleFrame> frames_;
  Array<Node> nodes_;
  Array<Block> blocks_;
  std::vector<Triangle> triangles_;
  std::vector<Vector3> vertices_;
  Vector3 center_;    ///< local coordinates = (x - center_)·scale_
  double scale_ = 1;  ///< 2 / longest side of the mesh's box
};

}  // namespace hpsdf::bvh
