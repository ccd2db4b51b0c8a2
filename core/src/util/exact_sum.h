#pragma once
// Sums of doubles without rounding.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace hpsdf::detail {

/// A sum of finite doubles that is kept exactly, as a long fixed-point number (the "superaccumulator" of Kulisch). It
/// depends neither on the order of the summands nor on how they are divided into partial sums.
class ExactSum {
 public:
  /// Adds `times` · `value`, where `times` is a small integer.
  void add(double value, int times = 1);
  void add(const ExactSum& other);

  /// Returns the sum, rounded to a double with an error of at most one unit in the last place; infinity or NaN if such
  /// a number was added. Equal sums return equal numbers.
  double value() const;

  /// The state of the sum as numbers, by which a process can send it to another one.
  static constexpr std::size_t kNumbers = 72;
  std::array<std::int64_t, kNumbers> numbers() const;
  static ExactSum fromNumbers(std::span<const std::int64_t, kNumbers> numbers);

 private:
  static constexpr int kBits = 32;                      // of a digit
  static constexpr int kDigits = kNumbers - 3;          // 2^-1074 … 2^1023, and room for carries
  static constexpr std::uint32_t kMostAdds = 1U << 28;  // so often numbers may be added before carries are moved on

  /// Moves carries on, so that the digits are not negative and have 32 bits, except that the last one has the sign of
  /// the sum.
  void normalize();

  /// Digits with signs: the sum is Σ digits_[i] · 2^(32·i - 1074).
  std::array<std::int64_t, kDigits> digits_{};
  std::size_t first_ = kDigits, end_ = 0;  ///< the range of digits that may differ from 0
  std::uint32_t adds_ = 0;                 ///< additions since the digits were last within 32 bits
  std::array<std::int64_t, 3> special_{};  ///< how often +infinity, -infinity and NaN were added
};

}  // namespace hpsdf::detail
