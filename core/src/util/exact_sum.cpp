#include "util/exact_sum.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>

namespace hpsdf::detail {
namespace {

constexpr int kLowest = -1074;  // exponent of the least double

}  // namespace

void ExactSum::add(double value, int times) {
  constexpr int kMantissaBits = 52, kExponentMask = 0x7ff;
  if (value == 0 || times == 0) return;
  if (!std::isfinite(value)) {
    special_[std::isnan(value) ? 2 : value > 0 ? 0 : 1] += times;
    return;
  }
  const auto bits = std::bit_cast<std::uint64_t>(value);
  const int exponent = int(bits >> kMantissaBits) & kExponentMask;
  std::uint64_t mantissa = bits & ((std::uint64_t{1} << kMantissaBits) - 1);
  if (exponent > 0) mantissa |= std::uint64_t{1} << kMantissaBits;
  const int shift = exponent > 0 ? exponent - 1 : 0;  // the number is mantissa · 2^(shift - 1074)
  const std::int64_t sign = (bits >> 63) != 0 ? -times : times;
  const std::size_t digit = std::size_t(shift) / kBits;
  const int within = shift % kBits;
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
  const std::uint64_t low = mantissa & kMask, high = mantissa >> kBits;  // 32 and 21 bits
  const std::uint64_t lowShifted = low << within, highShifted = high << within;
  digits_[digit] += sign * std::int64_t(lowShifted & kMask);
  digits_[digit + 1] += sign * std::int64_t((lowShifted >> kBits) + (highShifted & kMask));
  digits_[digit + 2] += sign * std::int64_t(highShifted >> kBits);
  first_ = std::min(first_, digit);
  end_ = std::max(end_, digit + 3);
  adds_ += std::uint32_t(std::abs(times));
  if (adds_ >= kMostAdds) normalize();
}

void ExactSum::add(const ExactSum& other) {
  normalize();
  ExactSum second = other;
  second.normalize();
  for (std::size_t i = second.first_; i < second.end_; ++i) digits_[i] += second.digits_[i];
  first_ = std::min(first_, second.first_);
  end_ = std::max(end_, second.end_);
  for (std::size_t i = 0; i < special_.size(); ++i) special_[i] += second.special_[i];
  adds_ = 1;
}

void ExactSum::normalize() {
  adds_ = 0;
  if (first_ >= end_) return;
  std::int64_t carry = 0;
  std::size_t i = first_;
  for (; i + 1 < digits_.size() && (i < end_ || (carry != 0 && carry != -1)); ++i) {
    const std::int64_t digit = digits_[i] + carry;
    carry = digit >> kBits;  // rounds down, so that no digit but the last is negative
    digits_[i] = digit - (carry << kBits);
  }
  digits_[i] += carry;
  end_ = std::max(carry != 0 ? i + 1 : i, end_);
}

double ExactSum::value() const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (special_[2] != 0 || (special_[0] != 0 && special_[1] != 0)) return std::numeric_limits<double>::quiet_NaN();
  if (special_[0] != 0 || special_[1] != 0) return special_[0] != 0 ? kInfinity : -kInfinity;
  if (first_ >= end_) return 0;
  ExactSum sum = *this;
  sum.normalize();
  const bool isNegative = sum.digits_[sum.end_ - 1] < 0;
  if (isNegative) {  // the digits of the magnitude tell its leading bits
    for (std::size_t i = first_; i < sum.end_; ++i) sum.digits_[i] = -sum.digits_[i];
    sum.normalize();
  }
  std::size_t top = sum.end_;
  while (top > first_ && sum.digits_[top - 1] == 0) --top;
  if (top == first_) return 0;
  // The three leading digits have at least 65 bits, or are all that there is.
  const auto digitAt = [&](std::size_t below) { return below <= top ? double(sum.digits_[top - below]) : 0; };
  constexpr double kRadix = 4294967296.0;
  const double lower = digitAt(2) * kRadix + digitAt(3);
  const double leading = digitAt(1) * kRadix * kRadix + lower;
  const double magnitude = std::ldexp(leading, kBits * (int(top) - 3) + kLowest);
  return isNegative ? -magnitude : magnitude;
}

std::array<std::int64_t, ExactSum::kNumbers> ExactSum::numbers() const {
  ExactSum sum = *this;
  sum.normalize();
  std::array<std::int64_t, kNumbers> result{};
  for (std::size_t i = 0; i < digits_.size(); ++i) result[i] = sum.digits_[i];
  std::copy(special_.begin(), special_.end(), result.end() - std::ptrdiff_t(special_.size()));
  return result;
}

ExactSum ExactSum::fromNumbers(std::span<const std::int64_t, kNumbers> numbers) {
  ExactSum sum;
  for (std::size_t i = 0; i < sum.digits_.size(); ++i) sum.digits_[i] = numbers[i];
  std::copy(numbers.end() - std::ptrdiff_t(sum.special_.size()), numbers.end(), sum.special_.begin());
  sum.first_ = 0, sum.end_ = kDigits;
  return sum;
}

}  // namespace hpsdf::detail
