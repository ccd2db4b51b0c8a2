#pragma once
// Parts of a finished field that several processes hold.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/detail/field_data.h"
#include "util/message.h"

namespace hpsdf::detail {

/// Returns a message that carries the nodes of a part, and how many elements of the array of coefficients each of its
/// leaves takes. The elements are numbers, or bytes if they are quantized.
Message nodesOf(const FieldData& part);
/// Returns a message that carries the coefficients of a part.
Message coefficientsOf(const FieldData& part);

/// Puts the parts of a field without exact leaves together, so that no more than one part is in memory besides the
/// field. In each part, the leaves of the others are exact ones without triangles (`layOut`). All parts have
/// coefficients of the same type. All else is that of the first part. Throws `Error` for damaged messages, and for
/// fields that are too large.
class Assembly {
 public:
  /// Takes the first part, and the nodes of the others (`nodesOf`).
  Assembly(FieldData&& first, std::span<const Message> nodesOfOthers);

  /// Adds the coefficients of a part (`coefficientsOf`). The first part has number 0, and is there already.
  void add(std::uint32_t part, std::span<const std::byte> coefficients);
  /// Returns the field, to which all parts must have been added.
  FieldData take() { return std::move(whole_); }

 private:
  struct Part {
    std::vector<std::uint64_t> nodes;
    std::vector<std::uint32_t> sizes;  ///< of each node's coefficients
  };
  /// A node of one of the parts.
  struct PartNode {
    std::uint32_t part, node;
  };
  struct PlacedLeaf {
    PartNode from;
    std::uint32_t to;          ///< node of the whole field
    std::uint32_t fromOffset;  ///< of its coefficients in the part
  };

  std::uint64_t bitsOf(const PartNode& at) const { return parts_[at.part].nodes[at.node]; }
  void placeNodes();
  void place(std::uint32_t to, const PartNode& from);
  /// Sets the offsets of all leaves, and returns the number of elements.
  std::size_t setOffsets();

  std::vector<Part> parts_;
  FieldData whole_;
  std::vector<PlacedLeaf> leaves_;  ///< in the order of their coefficients
};

}  // namespace hpsdf::detail
