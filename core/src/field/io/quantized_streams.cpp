#include "field/io/quantized_streams.h"

#include <algorithm>
#include <array>

#include "field/query/quantized.h"

namespace hpsdf::io {
namespace {

constexpr int kWidthBits = QuantizedCoefficients::kWidthBits;
constexpr int kMostBits = QuantizedCoefficients::kMostBits;
constexpr std::size_t kPadding = QuantizedCoefficients::kPadding;

std::size_t integersOfDegree(int d) { return std::size_t((d + 1) * (d + 2) / 2); }

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
  IntegerPlanes means;                               ///< the difference of each from the one before
  std::array<IntegerPlanes, kMostBits + 1> ofWidth;  ///< the integers of each width from 1
  std::uint32_t meanBits;

  explicit Parts(std::uint32_t bits) : meanBits(bits) {
    means.setWidth(bits);
    for (std::uint32_t width = 1; width < ofWidth.size(); ++width) ofWidth[width].setWidth(width);
  }
};

/// Appends integers of few bits to bytes, the lowest bit first.
class BitString {
 public:
  explicit BitString(Bytes& bytes) : bytes_(bytes) {}

  void push(std::uint64_t integer, std::uint32_t width) {
    pending_ |= integer << count_;
    for (count_ += width; count_ >= 8; count_ -= 8, pending_ >>= 8) bytes_.push_back(std::uint8_t(pending_));
  }

  void fillByte() {
    if (count_ > 0) push(0, 8 - count_);
  }

 private:
  Bytes& bytes_;
  std::uint64_t pending_ = 0;
  std::uint32_t count_ = 0;
};

/// Returns the lowest `width` bits of a number.
std::uint32_t lowestBits(std::uint64_t bits, std::uint32_t width) {
  return static_cast<std::uint32_t>(bits & ((std::uint64_t{1} << width) - 1));
}

/// Takes a leaf apart.
void splitLeaf(const query::LeafBits& leaf, int degree, std::uint32_t& mean, Parts& parts) {
  std::uint64_t position = std::uint64_t(degree) * kWidthBits;
  const std::uint32_t meanBefore = mean;
  mean = lowestBits(leaf.read(position), parts.meanBits);
  parts.means.push(lowestBits(mean - meanBefore, parts.meanBits));
  position += parts.meanBits;
  for (int d = 1; d <= degree; ++d) {
    const std::uint32_t width = lowestBits(leaf.read(std::uint64_t(d - 1) * kWidthBits), kWidthBits);
    parts.widths[d].push_back(std::uint8_t(width));
    if (width == 0) continue;
    for (std::size_t n = 0; n < integersOfDegree(d); ++n, position += width)
      parts.ofWidth[width].push(lowestBits(leaf.read(position), width));
  }
}

/// Puts together the next leaf, whose mean follows `mean`. `next` counts the leaves of each degree or a higher one.
void joinLeaf(Parts& parts, int degree, std::uint32_t& mean, std::array<std::size_t, kMaxDegree + 1>& next,
              BitString& out) {
  for (int d = 1; d <= degree; ++d) out.push(parts.widths[d][next[d]], kWidthBits);
  mean = lowestBits(std::uint64_t{mean} + parts.means.next(), parts.meanBits);
  out.push(mean, parts.meanBits);
  for (int d = 1; d <= degree; ++d) {
    const std::uint32_t width = parts.widths[d][next[d]++];
    if (width == 0) continue;
    for (std::size_t n = 0; n < integersOfDegree(d); ++n) out.push(parts.ofWidth[width].next(), width);
  }
  out.fillByte();
}

/// Returns the bytes of leaves of the given degrees and the padding. `size` is their number as far as it is known.
Bytes joined(Parts& parts, std::span<const std::uint8_t> degrees, std::size_t size) {
  Bytes bytes;
  bytes.reserve(size);
  BitString out(bytes);
  std::uint32_t mean = 0;
  std::array<std::size_t, kMaxDegree + 1> next{};
  for (const std::uint8_t degree : degrees) joinLeaf(parts, degree, mean, next, out);
  bytes.resize(bytes.size() + kPadding);
  return bytes;
}

/// Returns the number of integers of each width.
std::array<std::uint64_t, kMostBits + 1> countWidths(const Parts& parts) {
  std::array<std::uint64_t, kMostBits + 1> counts{};
  for (int d = 1; d <= kMaxDegree; ++d)
    for (const std::uint8_t width : parts.widths[d]) counts[width] += integersOfDegree(d);
  return counts;
}

/// Returns the number of bits of all leaves.
std::uint64_t countBits(const Parts& parts, std::size_t leaves) {
  std::uint64_t bits = std::uint64_t{leaves} * parts.meanBits;
  for (const Bytes& widths : parts.widths) bits += std::uint64_t{widths.size()} * kWidthBits;
  const auto counts = countWidths(parts);
  for (std::size_t width = 1; width < counts.size(); ++width) bits += counts[width] * width;
  return bits;
}

/// Reads the widths. Their numbers follow from the degrees of the leaves.
void readWidths(StreamsReader& reader, std::span<const std::uint8_t> degrees, Parts& parts) {
  std::array<std::size_t, kMaxDegree + 1> counts{};
  std::size_t all = 0;
  for (const std::uint8_t degree : degrees) {
    for (int d = 1; d <= degree; ++d) ++counts[d];
    all += degree;
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
                  std::span<const std::uint8_t> degrees) {
  Parts parts(coefficients.meanBits);
  std::uint32_t mean = 0, offset = 0;
  for (const std::uint8_t degree : degrees) {
    const std::size_t size = query::quantizedLeafBytes(coefficients, node::leaf(degree, offset));
    if (size == 0) return false;
    splitLeaf({coefficients.bytes.data() + offset}, degree, mean, parts);
    offset += std::uint32_t(size);
  }
  if (joined(parts, degrees, coefficients.bytes.size()) != coefficients.bytes) return false;
  Bytes widths;
  for (const Bytes& ofDegree : parts.widths) widths.insert(widths.end(), ofDegree.begin(), ofDegree.end());
  writer.add(widths);
  parts.means.add(writer);
  for (const IntegerPlanes& integers : parts.ofWidth) integers.add(writer);
  return true;
}

Bytes readQuantized(StreamsReader& reader, std::uint64_t size, std::uint32_t meanBits,
                    std::span<const std::uint8_t> degrees) {
  reader.require(meanBits >= 1 && meanBits <= QuantizedCoefficients::kMostMeanBits,
                 "the width of its coefficients is out of range");
  Parts parts(meanBits);
  readWidths(reader, degrees, parts);
  // Every leaf ends with a whole byte, so that the bits bound the size before memory is taken.
  const std::uint64_t least = countBits(parts, degrees.size()) / 8 + kPadding;
  reader.require(least <= size && size <= least + 1 + degrees.size(), "its coefficients have another size");
  parts.means.read(reader, degrees.size());
  const auto counts = countWidths(parts);
  for (std::size_t width = 1; width < counts.size(); ++width) parts.ofWidth[width].read(reader, counts[width]);
  Bytes bytes = joined(parts, degrees, size);
  reader.require(bytes.size() == size, "its coefficients have another size");
  return bytes;
}

}  // namespace hpsdf::io
