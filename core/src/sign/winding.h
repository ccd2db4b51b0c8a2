#pragma once
// The generalised winding number, by clusters of triangles.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bvh/hierarchy.h"

namespace hpsdf::distance {

/// How often the triangles of a hierarchy surround a point: a whole number for a closed mesh, any number where there
/// are holes (Jacobson, Kavan and Sorkine-Hornung 2013).
///
/// w(x) = 1/4π ∫ n·(q − x)/|q − x|³ dA over the surface. For a cluster of triangles that is far enough away, the
/// integrand's Taylor series about the cluster's center is taken, up to second order (Barill et al. 2018). Of a cluster
/// within r of its center, R away, what is left out is at most
///
///   A/4πR² (1/(1−t)² − 1 − 2t − 3t²),  t = r/R,  A = ∫ (|d|/r)³ dA,
///
/// because the term of degree l of 1/|R + d| is a solid harmonic, whose gradient is at most l |d|^(l−1)/R^(l+1), and
/// because the terms up to l = 3 are taken.
class Winding {
 public:
  Winding() = default;

  /// Refers to the hierarchy, which must stay where it is.
  explicit Winding(const Hierarchy& hierarchy);

  struct Estimate {
    double value = 0;
    double error = 0;  ///< so far from the exact sum at most
  };

  /// The rounding of a sum of up to `Hierarchy::kMaxTriangles` angles, with room to spare.
  static constexpr double kRounding = 1e-7;

  /// Level 0 is the coarsest.
  static constexpr int kLevels = 4;
  Estimate estimate(const Vector3& x, int level) const;

  /// To a twentieth, that of all triangles but the one in a slot.
  double withoutOne(const Vector3& x, std::uint32_t slot) const;

  /// The sum over all triangles, in the hierarchy's order.
  double exact(const Vector3& x) const;

  /// By the coarsest level whose error is no more, or that is enough otherwise, or the sum itself.
  template <typename Enough>
  Estimate within(const Vector3& x, double error, Enough isEnough) const {
    for (int level = 0; level < kLevels; ++level)
      if (const Estimate found = estimate(x, level); found.error <= error || isEnough(found)) return found;
    return {exact(x), kRounding};
  }

  /// Whether the exact sum is above this: by the coarsest level that can tell, or the sum itself.
  bool inside(const Vector3& x, double above = 0.5) const;

  std::size_t bytes() const;

 private:
  class Maker;

  /// Where a cluster is, and from how far on its moments stand for it.
  struct Place {
    Vector3 center = Vector3::Zero();               ///< in the hierarchy's local coordinates
    std::array<double, kLevels> squaredReach = {};  ///< for each level
    std::uint32_t next = 0;                         ///< the cluster that comes when this one is done
    std::uint32_t begin = 0, end = 0;               ///< its slots
  };

  /// ∫n dA, and the symmetric parts of ∫n⊗d dA (xx, yy, zz, xy, xz, yz) and ∫n⊗d⊗d dA (xxx, yyy, zzz, xxy, xxz, xyy,
  /// yyz, xzz, yzz, xyz), d from the center: the others have no say.
  struct Moments {
    Vector3 first = Vector3::Zero();
    std::array<double, 6> second = {};
    std::array<double, 10> third = {};
    double area = 0, radius = 0;  ///< A and r above

    /// 4π w as the series has it, `toCenter` from the point.
    double at(const Vector3& toCenter, double squaredDistance) const;
    /// What the series leaves out at most, of w.
    double error(double squaredDistance) const;
  };

  /// Of the triangles [begin, end).
  double sum(const Vector3& local, std::uint32_t begin, std::uint32_t end) const;

  const Hierarchy* hierarchy_ = nullptr;
  std::vector<Place> places_;      ///< a cluster before those that it is made of
  std::vector<Moments> moments_;   ///< of each
  std::vector<Vector3> vertices_;  ///< the hierarchy's, in local coordinates
};

}  // namespace hpsdf::distance
