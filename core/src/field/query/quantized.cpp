#include "field/query/quantized.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "basis/projection.h"

namespace hpsdf::query {
namespace {

constexpr int kWidthBits = QuantizedCoefficients::kWidthBits;

/// Returns the number that is added to integers of `width` bits before they are stored.
std::int64_t biasOf(int width) { return (std::int64_t{1} << width) >> 1; }

int meanBitsOf(const QuantizedCoefficients& coefficients, std::uint64_t leaf) {
  return node::isWide(leaf) ? QuantizedCoefficients::kMostMeanBits : static_cast<int>(coefficients.meanBits);
}

int widthOf(const LeafBits& leaf, int degree) {
  return static_cast<int>(lowBits(leaf.read(std::uint64_t(degree - 1) * kWidthBits), kWidthBits));
}

/// Returns the integer of a coefficient, whose unit is the step times the norm; or one that is too large to be stored.
std::int64_t integerOf(double coefficient, double unit) {
  constexpr double kTooLarge = 0x1p40;
  const double integer = coefficient / unit;
  return std::abs(integer) < kTooLarge ? std::llround(integer) : std::int64_t{1} << 40;
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

  /// Returns the greatest width of the degrees from 1 on.
  int greatestWidth(int degree) const { return *std::max_element(widths.begin() + 1, widths.begin() + degree + 1); }

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

/// Returns the least shift that makes a step no greater than another one.
int shiftOf(double step, double greatest) {
  int shift = 0;
  while (shift <= QuantizedCoefficients::kMostShift && std::ldexp(step, -shift) > greatest) ++shift;
  return shift;
}

double greatestStep(std::span<const std::uint64_t> nodes, std::span<const double> steps) {
  double greatest = 0;
  for (std::size_t n = 0; n < nodes.size(); ++n)
    if (node::isLeaf(nodes[n]) && !node::isExact(nodes[n])) greatest = std::max(greatest, steps[n]);
  return greatest;
}

}  // namespace

void decodeAnyLeaf(const QuantizedCoefficients& coefficients, std::uint64_t leaf, double* out) {
  const int degree = node::degree(leaf);
  const LeafBits bits{leafOf(coefficients, leaf)};
  // Decode the integers, ordered by total degree.
  std::array<std::int32_t, std::size_t(coefficientCount(kMaxDegree))> integers;
  std::array<const std::int32_t*, kMaxDegree + 1> next;  // integer of each total degree that comes next in `out`
  std::uint64_t position = std::uint64_t(degree) * kWidthBits;
  std::int32_t* end = integers.data();
  for (int d = 0; d <= degree; ++d) {
    const int width = d == 0 ? meanBitsOf(coefficients, leaf) : widthOf(bits, d);
    const std::int64_t bias = biasOf(width);
    next[d] = end;
    for (int n = 0; n < basis::termsOfDegree(d); ++n, position += std::uint64_t(width))
      *end++ = static_cast<std::int32_t>(std::int64_t(lowBits(bits.read(position), width)) - bias);
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
  const int mostBits = node::isWide(leaf) ? QuantizedCoefficients::kMostWideBits : QuantizedCoefficients::kMostBits;
  std::size_t bits = std::size_t(degree) * kWidthBits + std::size_t(meanBitsOf(coefficients, leaf));
  if (offset + bytesOf(bits) > end) return 0;
  const LeafBits leafBits{leafOf(coefficients, leaf)};
  for (int d = 1; d <= degree; ++d) {
    const int width = widthOf(leafBits, d);
    if (width > mostBits) return 0;
    bits += std::size_t(basis::termsOfDegree(d)) * width;
  }
  return offset + bytesOf(bits) > end ? 0 : bytesOf(bits);
}

std::optional<Quantized> quantized(const FieldData& field, std::span<const double> steps, double fieldStep,
                                   const detail::AcrossParts& parts) {
  const std::span<const double> coefficients = std::get<FieldArray<double>>(field.coefficients).all();
  Quantized result{
      .nodes = field.nodes,
      .coefficients = {.step = fieldStep > 0 ? fieldStep : parts.greatest(greatestStep(field.nodes, steps)),
                       .meanBits = 1,
                       .bytes = {}}};
  QuantizedCoefficients& out = result.coefficients;
  if (!(out.step >= QuantizedCoefficients::kLeastStep && out.step <= QuantizedCoefficients::kGreatestStep))
    return std::nullopt;

  // Choose the steps of the leaves, and find the bits of all means.
  bool fits = true;
  forEachPolynomial(result.nodes, [&](std::uint64_t& node) {
    const int shift = shiftOf(out.step, steps[std::size_t(&node - result.nodes.data())]);
    fits &= shift <= QuantizedCoefficients::kMostShift;
    const int degree = node::degree(node);
    const double* c = &coefficients[node::offset(node)];
    const double step = std::ldexp(out.step, -shift);
    const Integers integers(c, degree, step);
    const int width = integers.greatestWidth(degree);
    fits &= width <= QuantizedCoefficients::kMostWideBits && integers.widths[0] <= QuantizedCoefficients::kMostMeanBits;
    const bool isWide = width > QuantizedCoefficients::kMostBits;
    if (!isWide) out.meanBits = std::max(out.meanBits, std::uint32_t(integers.widths[0]));
    node = node::quantizedLeaf(degree, shift & QuantizedCoefficients::kMostShift, isWide, node::offset(node));
  });
  if (!parts.all(fits)) return std::nullopt;
  out.meanBits = static_cast<std::uint32_t>(parts.greatest(out.meanBits));

  // Write the integers.
  std::vector<std::uint8_t> bytes;
  forEachPolynomial(result.nodes, [&](std::uint64_t& node) {
    const int degree = node::degree(node);
    const Integers integers(&coefficients[node::offset(node)], degree, out.stepOf(node));
    node = node::quantizedLeaf(degree, node::shift(node), node::isWide(node), std::uint32_t(bytes.size()));
    integers.write(degree, meanBitsOf(out, node), bytes);
  });
  detail::ExactSum size;
  size.add(double(bytes.size()));
  parts.add(size);
  bytes.resize(bytes.size() + QuantizedCoefficients::kPadding);
  bytes.shrink_to_fit();
  out.bytes = std::move(bytes);
  if (size.value() + QuantizedCoefficients::kPadding > 0xffffffff) return std::nullopt;
  return result;
}

void take(Quantized&& quantized, FieldData& field) {
  field.nodes = std::move(quantized.nodes);
  field.coefficients = std::move(quantized.coefficients);
}

std::vector<double> stepsOf(const QuantizedCoefficients& coefficients, std::span<const std::uint64_t> nodes) {
  std::vector<double> steps(nodes.size());
  std::ranges::transform(nodes, steps.begin(), [&](std::uint64_t node) { return coefficients.stepOf(node); });
  return steps;
}

std::array<double, kMaxDegree + 1> quantizedBytesByDegree(std::span<const double> coefficients, int degree,
                                                          double step) {
  const Integers integers(coefficients.data(), degree, step);
  std::array<double, kMaxDegree + 1> bytes{};
  int bits = 0;
  for (int d = 0; d <= degree; ++d) {
    bits += basis::termsOfDegree(d) * integers.widths[d] + (d > 0 ? kWidthBits : 0);
    bytes[d] = std::ceil(bits / 8.0);
  }
  return bytes;
}

}  // namespace hpsdf::query

namespace hpsdf {

void decodeLeaf(const QuantizedCoefficients& coefficients, std::uint64_t leaf, double* out) {
  query::decodeAnyLeaf(coefficients, leaf, out);
  const double step = coefficients.stepOf(leaf);
  for (int i = 0; i < coefficientCount(node::degree(leaf)); ++i) out[i] *= step;
}

}  // namespace hpsdf
