#pragma once

#include <array>

#include "hpsdf/types.h"

namespace hpsdf {

/// What coefficient a of the half of an axis adds to coefficient i of the whole: L_i of the whole is
/// Σ_a share·L_a/‖L_a‖² of the half above; below, the signs of odd i + a change.
class HalfShares {
 public:
  HalfShares() {
    constexpr int n = kMaxDegree + 2;
    // L_i((t+1)/2) = Σ_a r[i][a] L_a(t), by the recurrences of L_i and of t·L_a
    std::array<std::array<double, n + 1>, n> r{};
    r[0][0] = 1;
    r[1][0] = r[1][1] = 0.5;
    for (int i = 1; i + 1 < n; ++i) {
      std::array<double, n + 1> product{};  // (t+1)/2 · L_i
      for (int a = 0; a <= i; ++a) {
        product[a] += r[i][a] / 2;
        product[a + 1] += r[i][a] * (a + 1) / (2 * a + 1) / 2;
        if (a > 0) product[a - 1] += r[i][a] * a / (2 * a + 1) / 2;
      }
      for (int a = 0; a <= i + 1; ++a) r[i + 1][a] = ((2 * i + 1) * product[a] - i * r[i - 1][a]) / (i + 1);
    }
    for (int i = 0; i < n; ++i)
      for (int a = 0; a <= i; ++a) share_[i][a] = r[i][a] * (2 * i + 1) / (2 * a + 1) / 2;
  }

  double above(int i, int a) const { return share_[i][a]; }
  double below(int i, int a) const { return (i + a) % 2 == 0 ? share_[i][a] : -share_[i][a]; }

 private:
  std::array<std::array<double, kMaxDegree + 2>, kMaxDegree + 2> share_{};
};

}  // namespace hpsdf
