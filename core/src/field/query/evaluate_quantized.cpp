// Evaluation of one leaf with quantized coefficients, which SIMD decodes.
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "field/query/quantized.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "field/query/evaluate_quantized.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include to follow foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hpsdf::query {
namespace HWY_NAMESPACE {
namespace {

// The functions of quantized-inl.h take numbers of one leaf or of several.
template <int N>
HWY_INLINE std::uint64_t times(std::uint64_t word) {
  return N * word;
}
HWY_INLINE bool isZero(std::uint64_t word) { return word == 0; }
HWY_INLINE std::uint64_t orAnd(std::uint64_t a, std::uint64_t b, std::uint64_t c) { return a | (b & c); }
HWY_INLINE double asNumber(std::uint64_t bits) { return std::bit_cast<double>(bits); }

#include "basis/legendre-inl.h"
#include "field/query/polynomial-inl.h"
#include "field/query/quantized-inl.h"

#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2  // better targets have lower numbers

namespace hn = hwy::HWY_NAMESPACE;

using Numbers = hn::FixedTag<double, 4>;
using Words = hn::FixedTag<std::uint64_t, 4>;

/// The greatest width of which four integers can be read at once. Degree 1 has only three.
constexpr int kMostAtOnce = 14;

/// The constants that decode four integers of one width. To load them is faster than to compute them in every query.
struct alignas(64) FourDigits {
  std::uint64_t shifts[4];  ///< multiples of the width
  std::uint64_t mask;
  double bias;
};

/// One entry for each width that a leaf can tell: nobody has checked leaves in a mapped file.
constexpr auto kFourDigits = [] {
  std::array<FourDigits, QuantizedCoefficients::kMostWideBits + 1> digits{};
  for (std::uint64_t width = 0; width < digits.size(); ++width) {
    const std::uint64_t values = std::uint64_t{1} << width;
    digits[width] = {{0, width, 2 * width, 3 * width}, values - 1, std::bit_cast<double>(values >> 1 | kWholeBits)};
  }
  return digits;
}();

/// Decodes the integers of the total degree D, four at a time. Returns the position after them.
template <int D>
HWY_INLINE std::uint64_t decodeFours(const std::uint8_t* leaf, std::uint64_t position, std::uint64_t width,
                                     double* out) {
  const Words words;
  const Numbers numbers;
  constexpr int kCount = basis::termsOfDegree(D);
  const FourDigits& digits = kFourDigits[width];
  const auto mask = hn::Set(words, digits.mask), whole = hn::Set(words, kWholeBits);
  const auto bias = hn::Set(numbers, digits.bias);
  const auto shifts = hn::Load(words, digits.shifts);
  for (int at = 0; at < kCount; at += 4) {
    std::uint64_t word = 0;
    std::memcpy(&word, leaf + (position >> 3), sizeof word);
    const auto shifted = hn::Set(words, word >> (position & 7)) >> shifts;
    hn::StoreU(hn::BitCast(numbers, hn::OrAnd(whole, shifted, mask)) - bias, numbers, out + at);
    position += std::uint64_t(std::min(4, kCount - at)) * width;
  }
  return position;
}

template <int P>
HWY_INLINE void decode(const std::uint8_t* leaf, std::uint32_t meanBits, double* out) {
  constexpr int kWidthBits = QuantizedCoefficients::kWidthBits;
  const LeafBits bits{leaf};
  const std::uint64_t head = bits.read(0);
  bool areLong = false;
  for (int degree = 2; degree <= P; ++degree) areLong |= widthOf(head, degree) > kMostAtOnce;
  if (areLong) [[unlikely]]
    return decodeLeaves<P>(bits, meanBits, out);
  out[0] = Digits<double, std::uint64_t>(meanBits).first(head >> (P * kWidthBits));
  std::uint64_t position = P * kWidthBits + meanBits;
  forEachUpTo(Constant<P - 1>(), [&](auto below) HWY_ATTR {
    constexpr int kBelow = decltype(below)::value;
    position = decodeFours<kBelow + 1>(leaf, position, widthOf(head, kBelow + 1), out + coefficientCount(kBelow));
  });
}

#else

template <int P>
HWY_INLINE void decode(const std::uint8_t* leaf, std::uint32_t meanBits, double* out) {
  decodeLeaves<P>(LeafBits{leaf}, meanBits, out);
}

#endif

/// Calls f(coefficients, Constant<P>) for the coefficients of a leaf of degree P from 1 to 5.
template <typename F>
HWY_INLINE auto withDecoded(const QuantizedCoefficients& coefficients, std::uint64_t leaf, const F& f) {
  const std::uint8_t* const bytes = leafOf(coefficients, leaf);
  const auto decoded = [&](auto degree) HWY_ATTR {
    constexpr int kDegree = decltype(degree)::value;
    std::array<double, std::size_t(coefficientCount(kDegree)) + 3> integers;  // Four are written at a time.
    decode<kDegree>(bytes, coefficients.meanBits, integers.data());
    return f(OrthonormalIntegers<kDegree, double>{integers.data()}, degree);
  };
  switch (node::degree(leaf)) {
    case 1:
      return decoded(Constant<1>());
    case 2:
      return decoded(Constant<2>());
    case 3:
      return decoded(Constant<3>());
    case 4:
      return decoded(Constant<4>());
    default:
      return decoded(Constant<5>());
  }
}

double valueOf(const QuantizedCoefficients& coefficients, std::uint64_t leaf, const std::array<double, 3>& local) {
  return withDecoded(coefficients, leaf,
                     [&](auto c, auto degree) HWY_ATTR { return evaluatePolynomial(c, degree, local); });
}

std::array<double, 4> valueAndGradientOf(const QuantizedCoefficients& coefficients, std::uint64_t leaf,
                                         const std::array<double, 3>& local) {
  return withDecoded(coefficients, leaf,
                     [&](auto c, auto degree) HWY_ATTR { return evaluatePolynomialWithGradient(c, degree, local); });
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf::query
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf::query {
namespace {

HWY_EXPORT(valueOf);
HWY_EXPORT(valueAndGradientOf);

constexpr int kMostVectorDegree = 5;

/// Returns true if SIMD decodes a leaf.
bool hasVectorCode(std::uint64_t leaf) {
  return node::degree(leaf) >= 1 && node::degree(leaf) <= kMostVectorDegree && !node::isWide(leaf);
}

/// Returns f(coefficients, degree) for any leaf.
template <typename F>
auto withAnyDecoded(const QuantizedCoefficients& coefficients, std::uint64_t leaf, const F& f) {
  std::array<double, std::size_t(coefficientCount(kMaxDegree))> decoded;
  decodeAnyLeaf(coefficients, leaf, decoded.data());
  return f(static_cast<const double*>(decoded.data()), node::degree(leaf));
}

}  // namespace

void evaluateLeaf(const QuantizedCoefficients& coefficients, const GridFrame&, const LeafPoint& leaf, double& value) {
  value = hasVectorCode(leaf.bits) ? HWY_DYNAMIC_DISPATCH(valueOf)(coefficients, leaf.bits, leaf.local)
                                   : withAnyDecoded(coefficients, leaf.bits, [&](const double* c, int degree) {
                                       return evaluatePolynomial(c, degree, leaf.local);
                                     });
  value *= coefficients.stepOf(leaf.bits);
}

void evaluateLeaf(const QuantizedCoefficients& coefficients, const GridFrame& frame, const LeafPoint& leaf,
                  ValueAndGradient& result) {
  const auto [value, x, y, z] = hasVectorCode(leaf.bits)
                                    ? HWY_DYNAMIC_DISPATCH(valueAndGradientOf)(coefficients, leaf.bits, leaf.local)
                                    : withAnyDecoded(coefficients, leaf.bits, [&](const double* c, int degree) {
                                        return evaluatePolynomialWithGradient(c, degree, leaf.local);
                                      });
  const double step = coefficients.stepOf(leaf.bits);
  result = {value * step, {x * step, y * step, z * step}};
  toWorldUnits(frame, leaf, result.gradient);
}

}  // namespace hpsdf::query
#endif
