#pragma once

#include <array>

#include "hpsdf/detail/legendre_part.h"
#include "hpsdf/types.h"

namespace hpsdf::basis {

/// The matrix that joins the projections of an interval's two halves into the projection of the whole interval: entry
/// (i, a) is the contribution of a half's coefficient a to coefficient i of the whole.
///
/// On the upper half L_i((t+1)/2) = Σ_a r_ia L_a(t), so that the entry is r_ia ‖L_a‖² / ‖L_i‖² / 2. On the lower half
/// the entries with odd i + a have the opposite sign.
class HalfShares {
 public:
  HalfShares() {
    constexpr int n = kMaxDegree + 2;
    const detail::LegendreRows r = detail::legendreOfPart(0.5, 0.5, n - 1);
    for (int i = 0; i < n; ++i)
      for (int a = 0; a <= i; ++a) share_[i][a] = r[i][a] * (2 * i + 1) / (2 * a + 1) / 2;
  }

  double above(int i, int a) const { return share_[i][a]; }
  double below(int i, int a) const { return (i + a) % 2 == 0 ? share_[i][a] : -share_[i][a]; }

 private:
  std::array<std::array<double, kMaxDegree + 2>, kMaxDegree + 2> share_{};
};

}  // namespace hpsdf::basis
