// Decoding and evaluation of quantized coefficients (`QuantizedCoefficients`). Like polynomial-inl.h, this file is
// included inside a namespace, once for each instruction set. `Number` is double or a SIMD vector of doubles, one for
// each of several leaves of the same degree. `Words` is an unsigned 64-bit number or a SIMD vector of as many.

/// The integers of leaves of degree P, ordered by total degree. Read in the order of `FieldData` they are the
/// coefficients of `evaluatePolynomial`, which takes them for those of the orthonormal basis.
template <int P, typename Number>
struct OrthonormalIntegers {
  const Number* integers;
  int next = 0;

  [[gnu::always_inline]] const Number& operator*() const { return integers[hpsdf::basis::kPlaceByDegree<P>[next]]; }
  [[gnu::always_inline]] OrthonormalIntegers operator++(int) { return {integers, next++}; }
};

template <int P, typename Number, typename Degree>
[[gnu::always_inline]] inline void toBasisOf(const OrthonormalIntegers<P, Number>&, Degree degree, Number* values) {
  forEachUpTo(
      degree, [&](auto i) __attribute__((always_inline)) { values[i] = values[i] * Number(hpsdf::basis::kRoot[i]); });
}

/// The bits of 2^52 as a double. A whole number n < 2^52 in the low bits turns it into the double 2^52 + n.
constexpr std::uint64_t kWholeBits = 0x4330000000000000;

/// Converts stored integers of `width` bits to numbers.
template <typename Number, typename Words>
struct Digits {
  [[gnu::always_inline]] explicit Digits(Words width)
      : mask((Words(1) << width) - Words(1)), bias(asNumber(((mask + Words(1)) >> Words(1)) | Words(kWholeBits))) {}

  /// Returns the integer that is stored in the lowest bits of `words`.
  [[gnu::always_inline]] Number first(Words words) const {
    return asNumber(orAnd(Words(kWholeBits), words, mask)) - bias;
  }

  Words mask;
  Number bias;  ///< 2^52 + 2^(width − 1), or 2^52 if the width is 0
};

/// Decodes the integers of the total degree D that begin at the bit `position` of each leaf. Returns the position after
/// them.
template <int D, typename Leaves, typename Words, typename Number>
[[gnu::always_inline]] inline Words decodeDegree(const Leaves& leaves, Words position, Words width, Number* out) {
  constexpr int kAtOnce = 3;  // A read gives 57 bits.
  constexpr int kCount = hpsdf::basis::termsOfDegree(D), kLast = (kCount - 1) % kAtOnce + 1;
  static_assert(kLast == kAtOnce || kLast == 1);
  const Digits<Number, Words> digits(width);
  const Words step = width + width + width;
  Words words = leaves.read(position);
  forEachUpTo(
      Constant<kCount - 1>(), [&](auto at) __attribute__((always_inline)) {
        constexpr int kAt = decltype(at)::value;
        if constexpr (kAt > 0 && kAt % kAtOnce == 0) {
          position = position + step;
          words = leaves.read(position);
        } else if constexpr (kAt > 0) {
          words = words >> width;
        }
        out[kAt] = digits.first(words);
      });
  return position + (kLast == kAtOnce ? step : width);
}

/// Decodes the integers of leaves of degree P, ordered by total degree.
template <int P, typename Leaves, typename Number>
[[gnu::always_inline]] inline void decodeLeaves(const Leaves& leaves, std::uint32_t meanBits, Number* out) {
  constexpr int kWidthBits = QuantizedCoefficients::kWidthBits;
  static_assert(P * kWidthBits + QuantizedCoefficients::kMostMeanBits <= 64 - 7);
  const auto begin = leaves.begin();
  using Words = std::remove_const_t<decltype(begin)>;
  const Words head = leaves.read(begin);
  out[0] = Digits<Number, Words>(Words(meanBits)).first(head >> Words(P * kWidthBits));
  Words position = begin + Words(P * kWidthBits + meanBits);
  forEachUpTo(
      Constant<P - 1>(), [&](auto below) __attribute__((always_inline)) {
        constexpr int kBelow = decltype(below)::value;
        const Words width = (head >> Words(kBelow * kWidthBits)) & Words((1 << kWidthBits) - 1);
        position = decodeDegree<kBelow + 1>(leaves, position, width, out + coefficientCount(kBelow));
      });
}
