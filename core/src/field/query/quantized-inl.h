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

/// Numbers of integers of the total degree D, from 1 to 5, that are decoded from one read, which gives at least 57
/// bits: in any leaf that is not wide, and in leaves with short integers, which are nearly all.
constexpr int kAlwaysAtOnce = 3;
template <int D>
constexpr int kShortAtOnce = std::array{1, 3, 6, 5, 8, 7}[D];

/// The greatest width of which `kShortAtOnce` integers can be decoded from one read.
template <int D>
constexpr int kShortWidth = 57 / kShortAtOnce<D>;

/// Returns the width of the integers of a total degree. `head` is the first word of a leaf.
template <typename Words>
[[gnu::always_inline]] inline Words widthOf(Words head, int degree) {
  constexpr int kWidthBits = QuantizedCoefficients::kWidthBits;
  return (head >> Words((degree - 1) * kWidthBits)) & Words((1 << kWidthBits) - 1);
}

/// Returns true if the integers of all given leaves of degree P are so short that `kShortAtOnce` can be decoded from
/// one read. `head` is the first word of each leaf. A sum reaches `kOverflow` if a width is too great.
template <int P, typename Words>
[[gnu::always_inline]] inline bool areShort(Words head) {
  constexpr int kOverflow = 1 << QuantizedCoefficients::kWidthBits;
  Words sums(0);
  forEachUpTo(
      Constant<P - 1>(), [&](auto below) __attribute__((always_inline)) {
        constexpr int kDegree = decltype(below)::value + 1;
        if constexpr (kShortAtOnce < kDegree >> kAlwaysAtOnce)
          sums = sums | (widthOf(head, kDegree) + Words(kOverflow - 1 - kShortWidth<kDegree>));
      });
  return isZero(sums & Words(kOverflow));
}

/// Decodes the integers of the total degree D that begin at the bit `position` of each leaf, `AtOnce` from each read.
/// `words` is what the first read gives.
template <int D, int AtOnce, typename Leaves, typename Words, typename Number>
[[gnu::always_inline]] inline void decodeDegree(const Leaves& leaves, Words position, Words width, Words words,
                                                Number* out) {
  const Digits<Number, Words> digits(width);
  forEachUpTo(
      Constant<hpsdf::basis::termsOfDegree(D) - 1>(), [&](auto at) __attribute__((always_inline)) {
        constexpr int kAt = decltype(at)::value;
        if constexpr (kAt > 0 && kAt % AtOnce == 0) {
          position = position + times<AtOnce>(width);
          words = leaves.read(position);
        } else if constexpr (kAt > 0) {
          words = words >> width;
        }
        out[kAt] = digits.first(words);
      });
}

/// Decodes the integers of leaves of degree P from degree 1 on, ordered by total degree. `head` is the first word of
/// each leaf.
template <int P, bool AreShort, typename Leaves, typename Words, typename Number>
[[gnu::always_inline]] inline void decodeDegrees(const Leaves& leaves, Words head, std::uint32_t meanBits,
                                                 Number* out) {
  const std::uint32_t first = P * QuantizedCoefficients::kWidthBits + meanBits;
  Words position = leaves.begin() + Words(first), words = leaves.readAllAt(first);
  forEachUpTo(
      Constant<P - 1>(), [&](auto below) __attribute__((always_inline)) {
        constexpr int kBelow = decltype(below)::value, kDegree = kBelow + 1;
        constexpr int kAtOnce = AreShort ? kShortAtOnce<kDegree> : kAlwaysAtOnce;
        const Words width = widthOf(head, kDegree);
        if constexpr (kBelow > 0) words = leaves.read(position);
        decodeDegree<kDegree, kAtOnce>(leaves, position, width, words, out + coefficientCount(kBelow) - 1);
        position = position + times<hpsdf::basis::termsOfDegree(kDegree)>(width);
      });
}

/// Decodes the integers of leaves of degree P, ordered by total degree.
template <int P, typename Leaves, typename Number>
[[gnu::always_inline]] inline void decodeLeaves(const Leaves& leaves, std::uint32_t meanBits, Number* out) {
  constexpr int kWidthBits = QuantizedCoefficients::kWidthBits;
  static_assert(P * kWidthBits + QuantizedCoefficients::kMostMeanBits <= 57);
  const auto head = leaves.head();
  using Words = std::remove_const_t<decltype(head)>;
  out[0] = Digits<Number, Words>(Words(meanBits)).first(head >> Words(P * kWidthBits));
  if (areShort<P>(head)) [[likely]]
    decodeDegrees<P, true>(leaves, head, meanBits, out + 1);
  else
    decodeDegrees<P, false>(leaves, head, meanBits, out + 1);
}
