#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "hpsdf/detail/exact_triangles.h"
#include "hpsdf/detail/triangle_search.h"

namespace hpsdf::detail {

/// Collects the lists of exact leaves and packs them into the arrays of a field. Equal lists are stored once. Only
/// triangles that are in a list are stored.
class ExactListPacker {
 public:
  explicit ExactListPacker(const TriangleSearch& search)
      : search_(search), numbers_(search.triangles().size(), kUnused) {}

  /// Marks triangles as used. All lists must be marked before the first one is packed.
  void mark(const TriangleList& list);
  /// Packs a list, with the reference for its sign if there is one, and returns its offset.
  std::uint32_t pack(const TriangleList& list, const LeafSign& sign);
  /// Returns the packed lists with the triangles and vertices to which they refer. The vertices are doubles.
  ExactTriangles finish();

 private:
  static constexpr std::uint32_t kUnused = 0xffffffff;

  void number();
  std::vector<std::uint32_t> packed(const TriangleList& list) const;

  const TriangleSearch& search_;
  std::vector<std::uint32_t> numbers_;  ///< for each triangle of the search, its index in the field
  bool isNumbered_ = false;
  std::vector<std::uint32_t> lists_;
  std::map<std::vector<std::uint32_t>, std::uint32_t> offsets_;  ///< offsets by packed list
};

/// Returns the number of words that a list takes in `ExactTriangles::lists`, if the packer's numbers follow each other
/// where those of the search do.
std::size_t packedWords(const TriangleList& list, const LeafSign& sign);

/// Returns the bytes of a list with so many words and of the triangles that count in its leaf. A triangle is stored
/// once, however many leaves refer to it; its bytes count in the leaf that contains its first corner.
inline double listBytesOf(std::size_t words, std::size_t ownedTriangles) {
  constexpr double kWord = 4, kTriangle = 12 + 12 / 2.0;  // a closed mesh has half as many vertices as triangles
  return kWord * double(words) + kTriangle * double(ownedTriangles);
}

/// Returns the box in which a leaf has a weight in a field whose blend zones are `blend` edges wide. The list of an
/// exact leaf must give the right distance there.
inline Box boxOfWeight(const Box& leaf, double blend) {
  const Vector3 width = blend * (leaf.max() - leaf.min());
  return Box(leaf.min() - width, leaf.max() + width);
}

}  // namespace hpsdf::detail
