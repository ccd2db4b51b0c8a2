// Decoding of one leaf with quantized coefficients, in SIMD.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "field/query/quantized.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "field/query/decode_leaf.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include to follow foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hpsdf::query {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3

using Numbers = hn::FixedTag<double, 4>;
using Words = hn::FixedTag<std::uint64_t, 4>;

/// The greatest width of which four integers can be read at once.
constexpr int kMostAtOnce = 14;

/// Decodes the integers of the total degree D, four at a time. Returns the position after them.
template <int D>
HWY_INLINE std::uint64_t decodeFours(const std::uint8_t* leaf, std::uint64_t position, std::uint64_t width,
                                     double* out) {
  const Words words;
  const Numbers numbers;
  constexpr int kCount = basis::termsOfDegree(D);
  const Digits<double, std::uint64_t> digits(width);
  const auto mask = hn::Set(words, digits.mask), whole = hn::Set(words, kWholeBits);
  const auto bias = hn::Set(numbers, digits.bias);
  // The product of 32-bit numbers suffices.
  const auto multiples = hn::BitCast(
      words, hn::MulEven(hn::BitCast(hn::FixedTag<std::uint32_t, 8>(), hn::Set(words, width)),
                         hn::BitCast(hn::FixedTag<std::uint32_t, 8>(), hn::Iota(words, 0))));
  for (int at = 0; at < kCount; at += 4) {
    std::uint64_t word = 0;
    std::memcpy(&word, leaf + (position >> 3), sizeof word);
    const auto shifted = hn::Set(words, word) >> (hn::Set(words, position & 7) + multiples);
    hn::StoreU(hn::BitCast(numbers, hn::OrAnd(whole, shifted, mask)) - bias, numbers, out + at);
    position += std::uint64_t(std::min(4, kCount - at)) * width;
  }
  return position;
}

template <int P>
void decode(const std::uint8_t* leaf, std::uint32_t meanBits, double* out) {
  constexpr int kWidthBits = QuantizedCoefficients::kWidthBits;
  const LeafBits bits{leaf};
  const std::uint64_t head = bits.read(0);
  const auto widthOf = [&](int degree) { return head >> ((degree - 1) * kWidthBits) & ((1 << kWidthBits) - 1); };
  bool isWide = false;
  for (int degree = 2; degree <= P; ++degree) isWide |= widthOf(degree) > kMostAtOnce;
  if (isWide) [[unlikely]]
    return decodeLeaves<P>(bits, meanBits, out);
  out[0] = Digits<double, std::uint64_t>(meanBits).first(head >> (P * kWidthBits));
  std::uint64_t position = P * kWidthBits + meanBits;
  forEachUpTo(
      Constant<P - 1>(), [&](auto below) HWY_ATTR {
        constexpr int kBelow = decltype(below)::value;
        position = decodeFours<kBelow + 1>(leaf, position, widthOf(kBelow + 1), out + coefficientCount(kBelow));
      });
}

#else

template <int P>
void decode(const std::uint8_t* leaf, std::uint32_t meanBits, double* out) {
  decodeLeaves<P>(LeafBits{leaf}, meanBits, out);
}

#endif

void decode1(const std::uint8_t* leaf, std::uint32_t meanBits, double* out) { decode<1>(leaf, meanBits, out); }
void decode2(const std::uint8_t* leaf, std::uint32_t meanBits, double* out) { decode<2>(leaf, meanBits, out); }
void decode3(const std::uint8_t* leaf, std::uint32_t meanBits, double* out) { decode<3>(leaf, meanBits, out); }
void decode4(const std::uint8_t* leaf, std::uint32_t meanBits, double* out) { decode<4>(leaf, meanBits, out); }

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace hpsdf::query
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hpsdf::query {

HWY_EXPORT(decode1);
HWY_EXPORT(decode2);
HWY_EXPORT(decode3);
HWY_EXPORT(decode4);

void decodeIntegers(Constant<1>, const std::uint8_t* leaf, std::uint32_t meanBits, double* out) {
  HWY_DYNAMIC_DISPATCH(decode1)(leaf, meanBits, out);
}

void decodeIntegers(Constant<2>, const std::uint8_t* leaf, std::uint32_t meanBits, double* out) {
  HWY_DYNAMIC_DISPATCH(decode2)(leaf, meanBits, out);
}

void decodeIntegers(Constant<3>, const std::uint8_t* leaf, std::uint32_t meanBits, double* out) {
  HWY_DYNAMIC_DISPATCH(decode3)(leaf, meanBits, out);
}

void decodeIntegers(Constant<4>, const std::uint8_t* leaf, std::uint32_t meanBits, double* out) {
  HWY_DYNAMIC_DISPATCH(decode4)(leaf, meanBits, out);
}

}  // namespace hpsdf::query
#endif
