#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "bvh/triangle_frame.h"
#include "bvh/triangle_tree.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"
#include "util/shared_array.h"

namespace hpsdf::bvh {

/// Throws `Error` of kind `mesh` unless the mesh has from 1 to `Hierarchy::kMaxTriangles` triangles, valid vertex
/// indices, and finite coordinates up to `kLargestCoordinate`.
void requireSurface(const TriangleMesh& mesh);
/// Throw the same `Error` for the number of faces of the mesh `name`, and for its vertex with this index.
void requireFaceCount(const std::string& name, std::size_t faces);
void requireFinite(const std::string& name, std::size_t index, const Vector3& vertex);

/// The triangle of a mesh that is nearest to a query point.
struct Nearest {
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};  ///< the slot where no triangle is near enough

  std::uint32_t slot = 0;     ///< position of the triangle in the order of the hierarchy
  double squared;             ///< squared distance to the triangle
  FramePoint point;           ///< the query point's position relative to the triangle
  Vector3 normal;             ///< `TriangleFrame::normal` of the triangle
  double length;              ///< `TriangleFrame::length` of the triangle
  std::uint32_t firstCorner;  ///< `TriangleFrame::firstCorner` of the triangle
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

/// Four triangles in single precision and local coordinates, with the fields of `TriangleFrame` except the normal,
/// 224 bytes. Block b holds the triangles with the slots from kWidth·b on. Unused places of the last block repeat the
/// last triangle.
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
};

/// Bounding-volume hierarchy of oriented boxes (Gottschalk et al. 1996) over triangles, with four children per node.
/// For a mesh without holes it takes about 109 bytes a triangle: 24 for triangles and vertices, 4 for the triangle's
/// index in the mesh, 56 for the block and 25 for nodes. The frames of triangles, which take 144 bytes, are computed
/// from the corners wherever one is needed.
///
/// A triangle's slot is its position in the order of the hierarchy, in which neighbouring triangles on the surface are
/// usually close in memory.
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

  std::span<const Node> nodes() const { return nodes_; }
  std::span<const Block> blocks() const { return blocks_; }

  std::span<const Triangle> triangles() const { return triangles_; }  ///< by slot: three indices into `vertices()` each
  std::span<const std::uint32_t> numbers() const { return numbers_; }  ///< by slot: the triangle's index in the mesh
  std::span<const Vector3> vertices() const { return vertices_; }      ///< vertices in use, in the order of first use

  /// Returns one past the last slot of a block's triangles; the first one is kWidth·block.
  std::uint32_t endOf(std::uint32_t block) const {
    return std::min((block + 1) * kWidth, static_cast<std::uint32_t>(triangles_.size()));
  }

  std::array<Vector3, 3> corners(std::uint32_t slot) const {
    const auto& [a, b, c] = triangles_[slot];
    return {vertices_[a], vertices_[b], vertices_[c]};
  }
  /// Computes the frame of the triangle in a slot.
  TriangleFrame frame(std::uint32_t slot) const { return makeFrame(corners(slot), numbers_[slot]); }

  std::size_t bytes() const;

  /// Calls visit(array) for each array of a hierarchy, and then visit(number) for the numbers of its local coordinates.
  /// A hierarchy into which they are copied is equal to the original.
  template <typename Self, typename Visit>
  static void forEachMember(Self& self, const Visit& visit) {
    visit(self.nodes_);
    visit(self.blocks_);
    visit(self.numbers_);
    visit(self.triangles_);
    visit(self.vertices_);
    for (int axis = 0; axis < 3; ++axis) visit(self.center_[axis]);
    visit(self.scale_);
  }

  /// Converts x to the local coordinates that nodes and blocks use.
  Vector3 local(const Vector3& x) const { return (x - center_) * scale_; }
  double scale() const { return scale_; }

 private:
  /// Fills the members triangles_ and vertices_ from the mesh, in the order of `numbers_`.
  void sortSurface(const TriangleMesh& mesh);
  void fill(Block& block, std::size_t index) const;

  detail::SharedArray<Node> nodes_;
  detail::SharedArray<Block> blocks_;
  detail::SharedArray<std::uint32_t> numbers_;
  detail::SharedArray<Triangle> triangles_;
  detail::SharedArray<Vector3> vertices_;
  Vector3 center_;    ///< local coordinates = (x - center_)·scale_
  double scale_ = 1;  ///< 2 / longest side of the mesh's bounding box
};

}  // namespace hpsdf::bvh
