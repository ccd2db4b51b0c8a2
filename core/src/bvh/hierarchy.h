#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bvh/triangle_frame.h"
#include "bvh/triangle_tree.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"
#include "util/array.h"

namespace hpsdf::distance {

/// Throws `Error`, naming the mesh, unless a hierarchy can be made of it: it has triangles, not too many, of vertices
/// that exist, and all coordinates are finite.
void requireSurface(const TriangleMesh& mesh);

/// The nearest triangle of a point.
struct Nearest {
  std::uint32_t place = 0;  ///< see `Hierarchy::frameAt`; to start a neighbour's search from
  FramePoint point;         ///< the point in that triangle's frame
};

constexpr int kPacket = 8;  ///< points that search together

/// Four oriented boxes as float, in coordinates that put the mesh into [-1, 1]³: 256 bytes.
struct alignas(64) Node {
  enum Field { center = 0, axes = 3, half = 12, fields = 15 };
  float field[fields][kWidth];
  /// Another node, or a block of triangles (kBlockBit), or nothing (kEmpty; its box is out of any reach).
  std::uint32_t child[kWidth];
};
constexpr std::uint32_t kBlockBit = 0x80000000;
constexpr std::uint32_t kEmpty = 0x7fffffff;

/// Square of a distance beyond those of all points that are searched by float. The boxes of empty children are farther.
constexpr float kOutOfReach = 1e33f;

/// Up to four triangles as float, in the same coordinates: a `TriangleFrame` without its normal. Unused lanes repeat
/// the last triangle.
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
  std::uint32_t first;  ///< its first triangle's frame; the others follow
  std::uint32_t count;
};

/// Hierarchy of oriented boxes over triangles, four to a node.
///
/// Nodes and blocks only decide what to skip: they are float, and every bound allows for the rounding, so that all
/// triangles are left over that can be the nearest to rounding. Among those the answer is the minimum by (squared
/// distance in double, mesh index): it depends neither on the tree nor on where a search started nor on the
/// instruction set.
class Hierarchy {
 public:
  Hierarchy() = default;

  /// Of what `requireSurface` accepts. `box`: the mesh's.
  Hierarchy(const TriangleMesh& mesh, const Box& box);

  static constexpr std::size_t kMaxTriangles = std::size_t{1} << 28;

  /// The triangle at a place: number `place % kWidth` of block `place / kWidth`.
  const TriangleFrame& frameAt(std::uint32_t place) const { return frames_[slotAt(place)]; }

  std::span<const Node> nodes() const { return nodes_; }
  std::span<const Block> blocks() const { return blocks_; }

  /// A triangle's number in the hierarchy's order, in which a block's triangles follow one another.
  std::uint32_t slotAt(std::uint32_t place) const { return blocks_[place / kWidth].first + place % kWidth; }

  // By slot; neighbours on the surface are mostly neighbours in memory.
  std::span<const TriangleFrame> frames() const { return frames_; }
  std::span<const std::array<std::uint32_t, 3>> triangles() const { return triangles_; }  ///< indices of `vertices`
  std::span<const Vector3> vertices() const { return vertices_; }  ///< those in use, in the order of their first use

  std::size_t bytes() const;

  /// x in the boxes' coordinates.
  Vector3 local(const Vector3& x) const { return (x - center_) * scale_; }
  double scale() const { return scale_; }

 private:
  /// Makes triangles_ and vertices_.
  void sortSurface(const TriangleMesh& mesh, const std::vector<std::uint32_t>& order);
  /// The block of slots [begin, end).
  void fill(Block& block, std::uint32_t begin, std::uint32_t end) const;

  Array<TriangleFrame> frames_;
  Array<Node> nodes_;
  Array<Block> blocks_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<Vector3> vertices_;
  Vector3 center_;    ///< local coordinates = (x - center_)·scale_
  double scale_ = 1;  ///< 1/half of the longest side of the mesh's box
};

}  // namespace hpsdf::distance
