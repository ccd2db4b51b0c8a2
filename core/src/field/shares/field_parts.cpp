#include "field/shares/field_parts.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <variant>

#include "field/cells/build_tree.h"
#include "field/query/quantized.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {
namespace {

/// A node of one of the parts.
struct PartNode {
  std::uint32_t part, node;
};

/// Puts parts together, depth first like `layOut`.
class Assembly {
 public:
  explicit Assembly(std::vector<FieldData>&& parts) : parts_(std::move(parts)), whole_(std::move(parts_[0])) {
    parts_[0].nodes = std::move(whole_.nodes);
    parts_[0].coefficients = std::move(whole_.coefficients);
  }

  FieldData whole() {
    placeNodes();
    std::visit([&](const auto& first) { joinCoefficients(first); }, parts_[0].coefficients);
    return std::move(whole_);
  }

 private:
  std::uint64_t bitsOf(const PartNode& at) const { return parts_[at.part].nodes[at.node]; }

  void placeNodes() {
    const std::uint32_t baseCells = whole_.grid[0] * whole_.grid[1] * whole_.grid[2];
    whole_.nodes.assign(baseCells, 0);
    source_.resize(baseCells);
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
        source_.resize(first + 8);
        for (std::uint32_t child = 8; child-- > 0;) {
          std::vector<PartNode> below;
          for (const PartNode& at : nodes) below.push_back({at.part, node::firstChild(bitsOf(at)) + child});
          stack.emplace_back(first + child, std::move(below));
        }
      }
    }
  }

  void place(std::uint32_t to, const PartNode& from) {
    whole_.nodes[to] = bitsOf(from);
    source_[to] = from.part;
    leaves_.push_back(to);
  }

  /// Copies the coefficients of the leaves, in depth-first order.
  template <typename T>
  void joinCoefficients(const FieldArray<T>&) {
    std::vector<T> joined;
    for (const std::uint32_t leaf : leaves_) {
      std::uint64_t& bits = whole_.nodes[leaf];
      const T* begin = query::leafOf(std::get<FieldArray<T>>(parts_[source_[leaf]].coefficients), bits);
      if (joined.size() > 0xffffffff)
        throw Error("the field needs more than 2^32 coefficients; raise the target error");
      bits = node::leaf(node::degree(bits), static_cast<std::uint32_t>(joined.size()));
      joined.insert(joined.end(), begin, begin + coefficientCount(node::degree(bits)));
    }
    whole_.coefficients = std::move(joined);
  }

  /// Copies the bytes of the leaves, in the order of their nodes.
  void joinCoefficients(const QuantizedCoefficients& first) {
    std::vector<std::uint8_t> joined;
    std::ranges::sort(leaves_);
    for (const std::uint32_t leaf : leaves_) {
      std::uint64_t& bits = whole_.nodes[leaf];
      const auto& from = std::get<QuantizedCoefficients>(parts_[source_[leaf]].coefficients);
      const std::uint8_t* begin = query::leafOf(from, bits);
      const std::size_t size = query::quantizedLeafBytes(from, bits);
      bits = node::quantizedLeaf(node::degree(bits), node::shift(bits), node::isWide(bits),
                                 static_cast<std::uint32_t>(joined.size()));
      joined.insert(joined.end(), begin, begin + size);
    }
    joined.resize(joined.size() + QuantizedCoefficients::kPadding);
    joined.shrink_to_fit();
    whole_.coefficients =
        QuantizedCoefficients{.step = first.step, .meanBits = first.meanBits, .bytes = std::move(joined)};
  }

  std::vector<FieldData> parts_;
  FieldData whole_;
  std::vector<std::uint32_t> source_;  ///< for each leaf of the field, the part that holds it
  std::vector<std::uint32_t> leaves_;
};

template <typename Stream, typename Coefficients>
void partItems(Stream& stream, Coefficients& coefficients) {
  if constexpr (requires { coefficients.meanBits; }) {
    stream.item(coefficients.step);
    stream.item(coefficients.meanBits);
    partItems(stream, coefficients.bytes);
  } else if constexpr (std::is_const_v<Coefficients>) {
    stream.list(coefficients.all());
  } else {
    stream.list(coefficients.values());
  }
}

}  // namespace

Message messageOf(const FieldData& part) {
  MessageWriter writer;
  writer.list(part.nodes);
  writer.item(static_cast<std::uint8_t>(part.coefficients.index()));
  std::visit([&](const auto& coefficients) { partItems(writer, coefficients); }, part.coefficients);
  return writer.take();
}

FieldData partOf(const Message& message) {
  MessageReader reader(message);
  FieldData part;
  reader.list(part.nodes);
  std::uint8_t type = 0;
  reader.item(type);
  reader.require(type < std::variant_size_v<decltype(part.coefficients)>, "its type of coefficients is unknown");
  if (type == 1) part.coefficients.emplace<1>();
  if (type == 2) part.coefficients.emplace<2>();
  std::visit([&](auto& coefficients) { partItems(reader, coefficients); }, part.coefficients);
  return part;
}

FieldData putTogether(std::vector<FieldData>&& parts) { return Assembly(std::move(parts)).whole(); }

}  // namespace hpsdf::detail
