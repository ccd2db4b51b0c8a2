#pragma once
// Random numbers that depend only on a seed and an index. They are the same for any number of threads and any
// standard library.

#include <cmath>
#include <cstdint>
#include <numbers>

#include "hpsdf/types.h"

namespace hpsdf::detail {

/// The SplitMix64 random number generator (Steele, Lea, Flood 2014). Each item of a sequence has a generator of its
/// own, which is seeded with the sequence's seed and the item's index.
class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t index) : state_(mixed(mixed(seed) + index)) {}

  std::uint64_t next() { return mixed(state_ += 0x9e3779b97f4a7c15); }

  /// Returns a random number that is uniform in [0, 1), with 53 random bits.
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }

  Vector3 inBox(const Box& box) {
    const double x = unit(), y = unit(), z = unit();
    return box.min() + box.sizes().cwiseProduct(Vector3(x, y, z));
  }

  /// Returns a random point that is uniform in the ball of this radius around the origin.
  Vector3 inBall(double radius) {
    const double z = 2 * unit() - 1, angle = 2 * std::numbers::pi * unit(), fromCenter = radius * std::cbrt(unit());
    const double fromAxis = std::sqrt(1 - z * z);
    return fromCenter * Vector3(fromAxis * std::cos(angle), fromAxis * std::sin(angle), z);
  }

 private:
  static std::uint64_t mixed(std::uint64_t x) {
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9;
    x = (x ^ x >> 27) * 0x94d049bb133111eb;
    return x ^ x >> 31;
  }

  std::uint64_t state_;
};

}  // namespace hpsdf::detail
