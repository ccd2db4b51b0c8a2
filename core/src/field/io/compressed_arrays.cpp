#include "field/io/compressed_arrays.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "field/io/byte_streams.h"
#include "field/io/quantized_streams.h"
#include "field/io/triangle_streams.h"
#include "field/query/quantized.h"

namespace hpsdf::io {
namespace {

constexpr std::uint64_t kLowHalf = 0xffffffff;

std::size_t baseCells(const FieldData& data) { return std::size_t{data.grid[0]} * data.grid[1] * data.grid[2]; }

/// Calls visit(n) for every node in depth-first order, in which constructions lay out a field. visit(n) may set the
/// index of the node's children. Returns false if some children lie beyond the end or there are too many.
template <typename Visit>
bool visitDepthFirst(const std::vector<std::uint64_t>& nodes, std::size_t baseCells, const Visit& visit) {
  std::vector<std::uint32_t> stack;
  std::size_t reached = baseCells;
  for (std::size_t base = 0; base < baseCells; ++base) {
    stack.push_back(static_cast<std::uint32_t>(base));
    while (!stack.empty()) {
      const std::uint32_t n = stack.back();
      stack.pop_back();
      visit(n);
      if (node::isLeaf(nodes[n])) continue;
      const std::size_t first = node::firstChild(nodes[n]);
      reached += 8;
      if (first + 8 > nodes.size() || reached > nodes.size()) return false;
      for (std::uint32_t child = 8; child-- > 0;) stack.push_back(static_cast<std::uint32_t>(first) + child);
    }
  }
  return reached == nodes.size();
}

/// Tells where the children, the coefficients or the list of a node begin, in a field that was laid out in depth-first
/// order.
class OffsetPrediction {
 public:
  explicit OffsetPrediction(const FieldData& data) : data_(data), children_(std::uint32_t(baseCells(data))) {}

  /// Returns the prediction for the next node, of which only the high half need be known.
  std::uint32_t of(std::uint64_t node) const {
    if (!node::isLeaf(node)) return children_;
    return node::isExact(node) ? list_ : coefficients_;
  }

  /// Goes on behind the children, the coefficients or the list of a node.
  void pass(std::uint64_t node) {
    if (!node::isLeaf(node))
      children_ = node::firstChild(node) + 8;
    else if (node::isExact(node))
      list_ = std::max(list_, node::offset(node) + std::uint32_t(listWords(data_.exact.lists, node::offset(node))));
    else
      coefficients_ = node::offset(node) + std::uint32_t(coefficientsOf(node));
  }

 private:
  std::size_t coefficientsOf(std::uint64_t leaf) const {
    const auto* quantized = std::get_if<QuantizedCoefficients>(&data_.coefficients);
    if (quantized == nullptr) return std::size_t(coefficientCount(node::degree(leaf)));
    const bool isReadable =
        quantized->bytes.size() >= QuantizedCoefficients::kPadding && node::degree(leaf) <= kMaxDegree;
    return isReadable ? query::quantizedLeafBytes(*quantized, leaf) : 0;
  }

  const FieldData& data_;
  std::uint32_t children_ = 0, coefficients_ = 0, list_ = 0;
};

bool isPolynomial(std::uint64_t node) { return node::isLeaf(node) && !node::isExact(node); }

/// The nodes of a field in the order in which a construction sets what their low halves refer to.
struct NodeOrder {
  std::vector<std::uint32_t> depthFirst;   ///< all nodes
  std::vector<std::uint32_t> polynomials;  ///< leaves with a polynomial
  std::vector<std::uint64_t> leaves;       ///< the nodes of the polynomials, with offsets of 0

  /// Adds the polynomials of the finished depth-first order. Quantized ones are laid out by the index of their nodes.
  void addPolynomials(const std::vector<std::uint64_t>& nodes, bool areQuantized) {
    for (std::uint32_t i = 0; i < depthFirst.size(); ++i) {
      const std::uint32_t n = areQuantized ? i : depthFirst[i];
      if (!isPolynomial(nodes[n])) continue;
      polynomials.push_back(n);
      leaves.push_back(nodes[n] & ~kLowHalf);
    }
  }
};

/// Calls f(n, low) for each node n with the prediction of its low half. f may set the low half.
template <typename F>
void predict(const FieldData& data, const NodeOrder& order, const F& f) {
  OffsetPrediction prediction(data);
  const auto next = [&](std::uint32_t n) {
    f(n, prediction.of(data.nodes[n]));
    prediction.pass(data.nodes[n]);
  };
  for (const std::uint32_t n : order.depthFirst)
    if (!isPolynomial(data.nodes[n])) next(n);
  for (const std::uint32_t n : order.polynomials) next(n);
}

/// Adds the high halves of the nodes, and then what their low halves differ by from the predictions.
NodeOrder addNodes(StreamsWriter& writer, const FieldData& data) {
  NodeOrder order;
  visitDepthFirst(data.nodes, baseCells(data), [&](std::uint32_t n) { order.depthFirst.push_back(n); });
  order.addPolynomials(data.nodes, std::holds_alternative<QuantizedCoefficients>(data.coefficients));
  std::vector<std::uint32_t> high, differences(data.nodes.size());
  for (const std::uint64_t node : data.nodes) high.push_back(std::uint32_t(node >> 32));
  predict(data, order,
          [&](std::uint32_t n, std::uint32_t low) { differences[n] = zigzag(std::uint32_t(data.nodes[n]) - low); });
  writer.addPlanes(high);
  writer.addPlanes(differences);
  return order;
}

/// The nodes of a file before their coefficients and lists are known, so that only indices of children are final.
struct UnfinishedNodes {
  NodeOrder order;
  std::vector<std::uint32_t> differences;
};

UnfinishedNodes readNodes(StreamsReader& reader, const FieldSizes& sizes, FieldData& data) {
  UnfinishedNodes unfinished;
  std::vector<std::uint32_t> high;
  reader.readPlanes(high, sizes.nodes);
  reader.readPlanes(unfinished.differences, sizes.nodes);
  data.nodes.resize(high.size());
  for (std::size_t n = 0; n < high.size(); ++n) data.nodes[n] = std::uint64_t{high[n]} << 32;
  auto children = static_cast<std::uint32_t>(baseCells(data));
  NodeOrder& order = unfinished.order;
  const bool areTrees = visitDepthFirst(data.nodes, baseCells(data), [&](std::uint32_t n) {
    std::uint64_t& node = data.nodes[n];
    order.depthFirst.push_back(n);
    if (node::isLeaf(node)) return;
    node = (node & ~kLowHalf) | std::uint32_t(children + unzigzag(unfinished.differences[n]));
    children = node::firstChild(node) + 8;
  });
  reader.require(areTrees, "its nodes are no trees");
  order.addPolynomials(data.nodes, sizes.coefficientBytes == kQuantized);
  return unfinished;
}

/// Sets the low halves of the nodes, when the coefficients and the lists are known.
void finishNodes(const UnfinishedNodes& unfinished, FieldData& data) {
  predict(data, unfinished.order, [&](std::uint32_t n, std::uint32_t low) {
    data.nodes[n] = (data.nodes[n] & ~kLowHalf) | std::uint32_t(low + unzigzag(unfinished.differences[n]));
  });
}

/// The forms of quantized coefficients.
enum class QuantizedForm : std::uint8_t { bytes, integers };

void addCoefficients(StreamsWriter& streams, const QuantizedCoefficients& coefficients, const NodeOrder& order) {
  StreamsWriter integers;
  const bool areIntegers = addQuantized(integers, coefficients, order.leaves);
  streams.addNumber(std::uint8_t(areIntegers ? QuantizedForm::integers : QuantizedForm::bytes));
  if (areIntegers)
    streams.append(integers);
  else
    streams.add(coefficients.bytes.all());
}

template <typename T>
void addCoefficients(StreamsWriter& streams, const FieldArray<T>& coefficients, const NodeOrder&) {
  streams.addPlanes(coefficients.all());
}

void readCoefficients(StreamsReader& reader, const FieldSizes& sizes, const NodeOrder& order, FieldData& data) {
  if (sizes.coefficientBytes == sizeof(float))
    return reader.readPlanes(data.coefficients.emplace<FieldArray<float>>().values(), sizes.coefficients);
  if (sizes.coefficientBytes == sizeof(double))
    return reader.readPlanes(data.coefficients.emplace<FieldArray<double>>().values(), sizes.coefficients);
  auto& coefficients = data.coefficients.emplace<QuantizedCoefficients>();
  coefficients.step = sizes.step;
  coefficients.meanBits = sizes.meanBits;
  std::uint8_t form = 0;
  reader.readNumber(form);
  reader.require(form <= std::uint8_t(QuantizedForm::integers), "its coefficients have an unknown form");
  const bool haveDegrees =
      std::ranges::all_of(order.leaves, [](std::uint64_t leaf) { return node::degree(leaf) <= kMaxDegree; });
  reader.require(haveDegrees, "a cell has an unknown degree");
  coefficients.bytes = QuantizedForm(form) == QuantizedForm::integers
                           ? readQuantized(reader, sizes.coefficients, sizes.meanBits, order.leaves)
                           : reader.read(sizes.coefficients);
}

}  // namespace

void writeCompressed(detail::CheckedWriter& writer, const FieldData& data) {
  StreamsWriter streams;
  addLists(streams, data.exact.lists);
  const NodeOrder order = addNodes(streams, data);
  std::visit([&](const auto& coefficients) { addCoefficients(streams, coefficients, order); }, data.coefficients);
  streams.addPlanes(data.bounds);
  addVertices(streams, data.exact);
  addTriangles(streams, data.exact.triangles);
  streams.write(writer);
}

void readCompressed(detail::CheckedReader& reader, const FieldSizes& sizes, FieldData& data) {
  StreamsReader streams(reader);
  data.exact.lists = readLists(streams, sizes.lists);
  const UnfinishedNodes unfinished = readNodes(streams, sizes, data);
  readCoefficients(streams, sizes, unfinished.order, data);
  finishNodes(unfinished, data);
  streams.readPlanes(data.bounds, sizes.bounds);
  readVertices(streams, sizes, data.exact);
  data.exact.triangles = readTriangles(streams, sizes.triangles);
}

}  // namespace hpsdf::io
