#include "field/shares/field_parts.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>
#include <variant>

#include "field/cells/build_tree.h"
#include "field/query/quantized.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {
namespace {

std::size_t sizeOf(const QuantizedCoefficients& coefficients, std::uint64_t leaf) {
  return query::quantizedLeafBytes(coefficients, leaf);
}
template <typename T>
std::size_t sizeOf(const FieldArray<T>&, std::uint64_t leaf) {
  return coefficientCount(node::degree(leaf));
}

/// Returns the number of elements of each node's coefficients.
std::vector<std::uint32_t> sizesOf(const FieldData& part) {
  std::vector<std::uint32_t> sizes(part.nodes.size(), 0);
  std::visit(
      [&](const auto& coefficients) {
        for (std::size_t n = 0; n < sizes.size(); ++n)
          if (node::isLeaf(part.nodes[n]) && !node::isExact(part.nodes[n]))
            sizes[n] = std::uint32_t(sizeOf(coefficients, part.nodes[n]));
      },
      part.coefficients);
  return sizes;
}

std::span<const std::byte> bytesOfCoefficients(const FieldData& part) {
  return std::visit([](const auto& coefficients) { return std::as_bytes(arrayOf(coefficients).all()); },
                    part.coefficients);
}

}  // namespace

Message nodesOf(const FieldData& part) {
  MessageWriter writer;
  writer.list(part.nodes);
  writer.list(sizesOf(part));
  return writer.take();
}

Message coefficientsOf(const FieldData& part) {
  const std::span<const std::byte> bytes = bytesOfCoefficients(part);
  return {bytes.begin(), bytes.end()};
}

Assembly::Assembly(FieldData&& first, std::span<const Message> nodesOfOthers) : whole_(std::move(first)) {
  parts_.push_back({whole_.nodes, sizesOf(whole_)});
  for (const Message& message : nodesOfOthers) {
    Part part;
    MessageReader reader(message);
    reader.list(part.nodes);
    reader.list(part.sizes);
    reader.require(part.sizes.size() == part.nodes.size(), "a size is missing");
    parts_.push_back(std::move(part));
  }
  placeNodes();
  const std::size_t elements = setOffsets();
  parts_.clear();
  std::visit(
      [&](auto& coefficients) {
        auto& array = arrayOf(coefficients);
        const auto own = std::exchange(array, std::remove_cvref_t<decltype(array)>());
        array.values().resize(elements);
        add(0, std::as_bytes(own.all()));
      },
      whole_.coefficients);
}

void Assembly::placeNodes() {
  const std::uint32_t baseCells = whole_.grid[0] * whole_.grid[1] * whole_.grid[2];
  whole_.nodes.assign(baseCells, 0);
  std::vector<std::pair<std::uint32_t, std::vector<PartNode>>> stack;  // a node of the field, and those of the parts
  for (std::uint32_t base = 0; base < baseCells; ++base) {
    std::vector<PartNode> all;
    for (std::uint32_t part = 0; part < parts_.size(); ++part) all.push_back({part, base});
    stack.emplace_back(base, std::move(all));
    while (!stack.empty()) {
      auto [to, nodes] = std::move(stack.back());
      stack.pop_back();
      std::erase_if(nodes, [&](const PartNode& at) { return node::isExact(bitsOf(at)); });
      if (nodes.empty()) throw Error("no process holds a cell of the field that several build");
      if (node::isLeaf(bitsOf(nodes[0]))) {
        place(to, nodes[0]);
        continue;
      }
      requireRoomForChildren(whole_.nodes.size());
      const auto first = static_cast<std::uint32_t>(whole_.nodes.size());
      whole_.nodes[to] = node::internal(first);
      whole_.nodes.resize(first + 8);
      for (std::uint32_t child = 8; child-- > 0;) {
        std::vector<PartNode> below;
        for (const PartNode& at : nodes) below.push_back({at.part, node::firstChild(bitsOf(at)) + child});
        stack.emplace_back(first + child, std::move(below));
      }
    }
  }
}

void Assembly::place(std::uint32_t to, const PartNode& from) {
  whole_.nodes[to] = bitsOf(from);
  leaves_.push_back({from, to, node::offset(bitsOf(from))});
}

std::size_t Assembly::setOffsets() {
  const bool areQuantized = std::holds_alternative<QuantizedCoefficients>(whole_.coefficients);
  // Numbers stand in depth-first order, quantized leaves in the order of their nodes (`layOut`).
  if (areQuantized) std::ranges::sort(leaves_, {}, &PlacedLeaf::to);
  std::size_t elements = 0;
  for (const PlacedLeaf& leaf : leaves_) {
    if (elements > 0xffffffff) throw Error("the field needs more than 2^32 coefficients; raise the target error");
    std::uint64_t& bits = whole_.nodes[leaf.to];
    const auto offset = static_cast<std::uint32_t>(elements);
    bits = areQuantized ? node::quantizedLeaf(node::degree(bits), node::shift(bits), node::isWide(bits), offset)
                        : node::leaf(node::degree(bits), offset);
    elements += parts_[leaf.from.part].sizes[leaf.from.node];
  }
  return elements + (areQuantized ? QuantizedCoefficients::kPadding : 0);
}

void Assembly::add(std::uint32_t part, std::span<const std::byte> coefficients) {
  std::visit(
      [&](auto& whole) {
        auto& to = arrayOf(whole).values();
        using T = typename std::remove_reference_t<decltype(to)>::value_type;
        const std::size_t padding = std::is_same_v<T, std::uint8_t> ? QuantizedCoefficients::kPadding : 0;
        for (std::size_t n = 0; n < leaves_.size(); ++n) {
          if (leaves_[n].from.part != part) continue;
          const std::size_t first = node::offset(whole_.nodes[leaves_[n].to]);
          const std::size_t end =
              n + 1 < leaves_.size() ? node::offset(whole_.nodes[leaves_[n + 1].to]) : to.size() - padding;
          const std::size_t from = std::size_t(leaves_[n].fromOffset) * sizeof(T), size = (end - first) * sizeof(T);
          if (from + size > coefficients.size())
            throw Error("a message of another process is damaged: it ends too early");
          if (size > 0) std::memcpy(to.data() + first, coefficients.data() + from, size);
        }
      },
      whole_.coefficients);
}

}  // namespace hpsdf::detail
