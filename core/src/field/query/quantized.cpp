#include "field/query/quantized.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "basis/projection.h"

namespace hpsdf::query {
namespace {

constexpr int kWidthBits = QuantizedCoefficients::kWidthBits;

std::uint64_t lowBits(std::uint64_t word, int count) { return word & ((std::uint64_t{1} << count) - 1); }

/// Returns the number that is added to integers of `width` bits before they are stored.
std::int64_t biasOf(int width) { return (std::int64_t{1} << width) >> 1; }

int widthOf(const LeafBits& leaf, int degree) {
  return static_cast<int>(lowBits(leaf.read(std::uint64_t(degree - 1) * kWidthBits), kWidthBits));
}

/// Appends numbers of few bits to an array of bytes.
class BitWriter {
 public:
  explicit BitWriter(std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}

  void add(std::uint64_t number, int width) {
    pending_ |= number << count_;
    for (count_ += width; count_ >= 8; count_ -= 8, pending_ >>= 8) bytes_.push_back(std::uint8_t(pending_));
  }

  /// Fills the last byte with zeros.
  void finishByte() {
    if (count_ > 0) add(0, 8 - count_);
  }

 private:
  std::vector<std::uint8_t>& bytes_;
  std::uint64_t pending_ = 0;
  int count_ = 0;
};

/// Returns the integer of a coefficient, whose unit is the step times the norm.
std::int64_t integerOf(double coefficient, double unit) {
  constexpr double kLargest = 0x1p40;  // more than any integer that can be stored
  return std::llround(std::clamp(coefficient / unit, -kLargest, kLargest));
}

/// Returns the number of bits that an integer takes, or `least` if that is more.
int widthFor(std::int64_t integer, int least) {
  int width = least;
  while (integer < -biasOf(width) || integer > std::max<std::int64_t>(biasOf(width) - 1, 0)) ++width;
  return width;
}

/// The integers of a leaf, ordered by total degree, and the bits that each degree needs.
struct Integers {
  std::array<std::int64_t, std::size_t(coefficientCount(kMaxDegree))> all;
  std::array<int, kMaxDegree + 1> widths{};

  Integers(const double* c, int degree, double step) {
    basis::forEachCoefficient(degree, [&](int i, int j, int k, int index) {
      const std::int64_t integer = integerOf(c[index], step * basis::norm(i, j, k));
      all[basis::placeByDegree(i, j, k)] = integer;
      widths[i + j + k] = widthFor(integer, widths[i + j + k]);
    });
  }

  void write(int degree, int meanBits, std::vector<std::uint8_t>& bytes) const {
    BitWriter writer(bytes);
    for (int d = 1; d <= degree; ++d) writer.add(std::uint64_t(widths[d]), kWidthBits);
    const std::int64_t* next = all.data();
    for (int d = 0; d <= degree; ++d) {
      const int width = d == 0 ? meanBits : widths[d];
      for (int n = 0; n < basis::termsOfDegree(d); ++n) writer.add(std::uint64_t(*next++ + biasOf(width)), width);
    }
    writer.finishByte();
  }
};

/// Calls f(node) with each leaf of a field that has a polynomial.
template <typename Nodes, typename F>
void forEachPolynomial(Nodes& nodes, const F& f) {
  for (auto& node : nodes)
    if (node::isLeaf(node) && !node::isExact(node)) f(node);
}

}  // namespace

void decodeAnyLeaf(const LeafBits& leaf, int degree, std::uint32_t meanBits, double* out) {
  // Decode the integers, ordered by total degree.
  std::array<std::int32_t, std::size_t(coefficientCount(kMaxDegree))> integers;
  std::array<const std::int32_t*, kMaxDegree + 1> next;  // integer of each total degree that comes next in `out`
  std::uint64_t position = std::uint64_t(degree) * kWidthBits;
  std::int32_t* end = integers.data();
  for (int d = 0; d <= degree; ++d) {
    const int width = d == 0 ? static_cast<int>(meanBits) : widthOf(leaf, d);
    const std::int64_t bias = biasOf(width);
    next[d] = end;
    for (int n = 0; n < basis::termsOfDegree(d); ++n, position += std::uint64_t(width))
      *end++ = static_cast<std::int32_t>(std::int64_t(lowBits(leaf.read(position), width)) - bias);
  }
  // Within a total degree, the order of `out` is that of the integers.
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; j <= degree - i; ++j) {
      const double root = basis::kRoot[i] * basis::kRoot[j];
      for (int k = 0; k <= degree - i - j; ++k) *out++ = *next[i + j + k]++ * (root * basis::kRoot[k]);
    }
}

std::size_t quantizedLeafBytes(const QuantizedCoefficients& coefficients, std::uint64_t leaf) {
  const std::size_t offset = node::offset(leaf), end = coefficients.bytes.size() - QuantizedCoefficients::kPadding;
  const int degree = node::degree(leaf);
  const auto bytesOf = [](std::size_t bits) { return (bits + 7) / 8; };
  std::size_t bits = std::size_t(degree) * kWidthBits + coefficients.meanBits;
  if (offset + bytesOf(bits) > end) return 0;
  for (int d = 1; d <= degree; ++d) {
    const int width = widthOf({coefficients.bytes.data() + offset}, d);
    if (width > QuantizedCoefficients::kMostBits) return 0;
    bits += std::size_t(basis::termsOfDegree(d)) * width;
  }
  return offset + bytesOf(bits) > end ? 0 : bytesOf(bits);
}

std::optional<Quantized> quantized(const FieldData& field, double step) {
  const auto& coefficients = std::get<std::vector<double>>(field.coefficients);
  Quantized result{.nodes = field.nodes, .coefficients = {.step = step, .meanBits = 1, .bytes = {}}};
  QuantizedCoefficients& out = result.coefficients;
  forEachPolynomial(field.nodes, [&](std::uint64_t node) {
    const std::int64_t mean = integerOf(coefficients[node::offset(node)], step);
    out.meanBits = std::uint32_t(widthFor(mean, int(out.meanBits)));
  });
  if (out.meanBits > QuantizedCoefficients::kMostMeanBits) return std::nullopt;

  bool fits = true;
  forEachPolynomial(result.nodes, [&](std::uint64_t& node) {
    if (!fits) return;
    const int degree = node::degree(node);
    const Integers integers(&coefficients[node::offset(node)], degree, step);
    fits = *std::max_element(integers.widths.begin() + 1, integers.widths.end()) <= QuantizedCoefficients::kMostBits;
    if (!fits) return;
    node = node::leaf(degree, std::uint32_t(out.bytes.size()));
    integers.write(degree, int(out.meanBits), out.bytes);
  });
  if (!fits) return std::nullopt;
  out.bytes.resize(out.bytes.size() + QuantizedCoefficients::kPadding);
  out.bytes.shrink_to_fit();
  if (out.bytes.size() > 0xffffffff) return std::nullopt;
  return result;
}

bool quantize(FieldData& field, double step) {
  std::optional<Quantized> result = quantized(field, step);
  if (!result) return false;
  field.nodes = std::move(result->nodes);
  field.coefficients = std::move(result->coefficients);
  return true;
}

}  // namespace hpsdf::query

namespace hpsdf {

void decodeLeaf(const QuantizedCoefficients& coefficients, std::uint64_t leaf, double* out) {
  const int degree = node::degree(leaf);
  query::decodeAnyLeaf({coefficients.bytes.data() + node::offset(leaf)}, degree, coefficients.meanBits, out);
  for (int i = 0; i < coefficientCount(degree); ++i) out[i] *= coefficients.step;
}

}  // namespace hpsdf
