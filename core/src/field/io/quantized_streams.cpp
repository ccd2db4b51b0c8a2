#include "field/io/quantized_streams.h"

#include <algorithm>
#include <array>

#include "field/query/quantized.h"

namespace hpsdf::io {
namespace {

constexpr int kWidthBits = QuantizedCoefficients::kWidthBits;
constexpr int kMostBits = QuantizedCoefficients::kMostWideBits;
constexpr std::size_t kPadding = QuantizedCoefficients::kPadding;

/// Integers of one width, from 1 to 32 bits. The first plane holds the highest eight bits of each, the next one the
/// eight bits below, and so on. The last plane is filled up with zeros.
class IntegerPlanes {
 public:
  void setWidth(std::uint32_t width) { width_ = width; }
  std::size_t planes() const { return (width_ + 7) / 8; }

  void push(std::uint32_t integer) {
    std::uint32_t rest = integer << (32 - width_);
    for (std::size_t k = 0; k < planes(); ++k, rest <<= 8) planes_[k].push_back(std::uint8_t(rest >> 24));
  }

  /// Returns the integer after the one that was returned before.
  std::uint32_t next() {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < planes(); ++k) bits |= std::uint32_t{planes_[k][next_]} << (24 - 8 * k);
    ++next_;
    return bits >> (32 - width_);
  }

  void add(StreamsWriter& writer) const {
    for (std::size_t k = 0; k < planes(); ++k) writer.add(planes_[k]);
  }
  void read(StreamsReader& reader, std::uint64_t count) {
    for (std::size_t k = 0; k < planes(); ++k) planes_[k] = reader.read(count);
  }

 private:
  std::uint32_t width_ = 1;
  std::array<Bytes, 4> planes_;
  std::size_t next_ = 0;
};

/// The parts of quantized coefficients that are compressed one by one.
struct Parts {
  std::array<Bytes, kMaxDegree + 1> widths;          ///< for each total degree from 1, those of all leaves
  std::array<IntegerPlanes, 2> means;                ///< of leaves that are not wide, and of wide ones
  std::array<IntegerPlanes, kMostBits + 1> ofWidth;  ///< the integers of each width from 1
  std::array<std::uint32_t, 2> meanBits;

  explicit Parts(std::uint32_t bits) : meanBits{bits, QuantizedCoefficients::kMostMeanBits} {
    for (std::size_t kind = 0; kind < means.size(); ++kind) means[kind].setWidth(meanBits[kind]);
    for (std::uint32_t width = 1; width < ofWidth.size(); ++width) ofWidth[width].setWidth(width);
  }
};

/// Returns the lowest `width` bits of a number.
std::uint32_t lowestBits(std::uint64_t bits, std::uint32_t width) {
  return static_cast<std::uint32_t>(query::lowBits(bits, int(width)));
}

/// The means of the last leaf that was not wide, and of the last wide one. Each mean is stored as the difference from
/// the one before.
using LastMeans = std::array<std::uint32_t, 2>;

/// Takes a leaf apart. `node` is the packed node.
void splitLeaf(const query::LeafBits& leaf, std::uint64_t node, LastMeans& means, Parts& parts) {
  const int degree = node::degree(node);
  const std::size_t kind = node::isWide(node) ? 1 : 0;
  const std::uint32_t meanBits = parts.meanBits[kind];
  std::uint64_t position = std::uint64_t(degree) * kWidthBits;
  const std::uint32_t meanBefore = means[kind];
  means[kind] = lowestBits(leaf.read(position), meanBits);
  parts.means[kind].push(lowestBits(means[kind] - meanBefore, meanBits));
  position += meanBits;
  for (int d = 1; d <= degree; ++d) {
    const std::uint32_t width = lowestBits(leaf.read(std::uint64_t(d - 1) * kWidthBits), kWidthBits);
    parts.widths[d].push_back(std::uint8_t(width));
    if (width == 0) continue;
    for (int n = 0; n < basis::termsOfDegree(d); ++n, position += width)
      parts.ofWidth[width].push(lowestBits(leaf.read(position), width));
  }
}

/// Puts together the next leaf. `next` counts the leaves of each degree or a higher one.
void joinLeaf(Parts& parts, std::uint64_t node, LastMeans& means, std::array<std::size_t, kMaxDegree + 1>& next,
              query::BitWriter& out) {
  const int degree = node::degree(node);
  const std::size_t kind = node::isWide(node) ? 1 : 0;
  for (int d = 1; d <= degree; ++d) out.add(parts.widths[d][next[d]], kWidthBits);
  means[kind] = lowestBits(std::uint64_t{means[kind]} + parts.means[kind].next(), parts.meanBits[kind]);
  out.add(means[kind], int(parts.meanBits[kind]));
  for (int d = 1; d <= degree; ++d) {
    const std::uint32_t width = parts.widths[d][next[d]++];
    if (width == 0) continue;
    for (int n = 0; n < basis::termsOfDegree(d); ++n) out.add(parts.ofWidth[width].next(), int(width));
  }
  out.finishByte();
}

/// Returns the bytes of leaves and the padding. `size` is their number as far as it is known.
Bytes joined(Parts& parts, std::span<const std::uint64_t> leaves, std::size_t size) {
  Bytes bytes;
  bytes.reserve(size);
  query::BitWriter out(bytes);
  LastMeans means{};
  std::array<std::size_t, kMaxDegree + 1> next{};
  for (const std::uint64_t leaf : leaves) joinLeaf(parts, leaf, means, next, out);
  bytes.resize(bytes.size() + kPadding);
  return bytes;
}

/// Returns the number of integers of each width.
std::array<std::uint64_t, kMostBits + 1> countWidths(const Parts& parts) {
  std::array<std::uint64_t, kMostBits + 1> counts{};
  for (int d = 1; d <= kMaxDegree; ++d)
    for (const std::uint8_t width : parts.widths[d]) counts[width] += std::uint64_t(basis::termsOfDegree(d));
  return counts;
}

/// Returns the number of bits of all leaves.
std::uint64_t countBits(const Parts& parts, const std::array<std::uint64_t, 2>& leaves) {
  std::uint64_t bits = leaves[0] * parts.meanBits[0] + leaves[1] * parts.meanBits[1];
  for (const Bytes& widths : parts.widths) bits += std::uint64_t{widths.size()} * kWidthBits;
  const auto counts = countWidths(parts);
  for (std::size_t width = 1; width < counts.size(); ++width) bits += counts[width] * width;
  return bits;
}

/// Reads the widths. Their numbers follow from the degrees of the leaves.
void readWidths(StreamsReader& reader, std::span<const std::uint64_t> leaves, Parts& parts) {
  std::array<std::size_t, kMaxDegree + 1> counts{};
  std::size_t all = 0;
  for (const std::uint64_t leaf : leaves) {
    for (int d = 1; d <= node::degree(leaf); ++d) ++counts[d];
    all += std::size_t(node::degree(leaf));
  }
  const Bytes widths = reader.read(all);
  reader.require(std::ranges::all_of(widths, [](std::uint8_t width) { return width <= kMostBits; }),
                 "a width of its coefficients is out of range");
  auto from = widths.begin();
  for (int d = 1; d <= kMaxDegree; from += std::ptrdiff_t(counts[d]), ++d)
    parts.widths[d].assign(from, from + std::ptrdiff_t(counts[d]));
}

}  // namespace

bool addQuantized(StreamsWriter& writer, const QuantizedCoefficients& coefficients,
                  std::span<const std::uint64_t> leaves) {
  Parts parts(coefficients.meanBits);
  LastMeans means{};
  std::uint32_t offset = 0;
  for (const std::uint64_t leaf : leaves) {
    const std::size_t size = query::quantizedLeafBytes(coefficients, leaf | offset);
    if (size == 0) return false;
    splitLeaf({query::leafOf(coefficients, leaf | offset)}, leaf, means, parts);
    offset += std::uint32_t(size);
  }
  if (joined(parts, leaves, coefficients.bytes.size()) != coefficients.bytes) return false;
  Bytes widths;
  for (const Bytes& ofDegree : parts.widths) widths.insert(widths.end(), ofDegree.begin(), ofDegree.end());
  writer.add(widths);
  for (const IntegerPlanes& ofKind : parts.means) ofKind.add(writer);
  for (const IntegerPlanes& integers : parts.ofWidth) integers.add(writer);
  return true;
}

Bytes readQuantized(StreamsReader& reader, std::uint64_t size, std::uint32_t meanBits,
                    std::span<const std::uint64_t> leaves) {
  reader.require(meanBits >= 1 && meanBits <= QuantizedCoefficients::kMostMeanBits,
                 "the width of its coefficients is out of range");
  Parts parts(meanBits);
  readWidths(reader, leaves, parts);
  const auto wide = std::uint64_t(std::ranges::count_if(leaves, node::isWide));
  const std::array<std::uint64_t, 2> counts = {leaves.size() - wide, wide};
  // Every leaf ends with a whole byte, so that the bits bound the size before memory is taken.
  const std::uint64_t least = countBits(parts, counts) / 8 + kPadding;
  reader.require(least <= size && size <= least + 1 + leaves.size(), "its coefficients have another size");
  for (std::size_t kind = 0; kind < counts.size(); ++kind) parts.means[kind].read(reader, counts[kind]);
  const auto ofWidth = countWidths(parts);
  for (std::size_t width = 1; width < ofWidth.size(); ++width) parts.ofWidth[width].read(reader, ofWidth[width]);
  Bytes bytes = joined(parts, leaves, size);
  reader.require(bytes.size() == size, "its coefficients have another size");
  return bytes;
}

}  // namespace hpsdf::io
