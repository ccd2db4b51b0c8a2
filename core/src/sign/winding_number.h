#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bvh/hierarchy.h"

namespace hpsdf::sign {

/// The generalised winding number of a hierarchy's triangles about a point: a whole number if the mesh is closed, any
/// number if it has holes (Jacobson, Kavan and Sorkine-Hornung 2013).
///
/// w(x) = 1/4π ∫ n·(q − x)/|q − x|³ dA over the surface. A cluster of triangles that is far enough from x is replaced
/// by the Taylor series of the integrand about the cluster's center, up to second order (Barill et al. 2018). If all
/// triangles lie within r of the center, and the center is R from x, the truncation error is at most
///
///   A/4πR² (1/(1−t)² − 1 − 2t − 3t²),  t = r/R,  A = ∫ (|d|/r)³ dA,  d from the center,
///
/// because the term of degree l of 1/|R + d| is a solid harmonic, whose gradient is at most l |d|^(l−1)/R^(l+1), and
/// the series contains the terms up to l = 3.
class WindingNumber {
 public:
  WindingNumber() = default;

  /// Keeps a pointer to the hierarchy, which must neither move nor end before this object.
  explicit WindingNumber(const bvh::Hierarchy& hierarchy);

  struct Estimate {
    double value = 0;
    double error = 0;  ///< bound of the distance to the exact sum
  };

  /// Bound of the rounding error of a sum of up to `Hierarchy::kMaxTriangles` solid angles.
  static constexpr double kRounding = 1e-7;

  /// Number of accuracy levels; level 0 is the coarsest and cheapest.
  static constexpr int kLevels = 4;
  Estimate estimate(const Vector3& x, int level) const;

  /// Returns the winding number without the contribution of one triangle, to within 0.05.
  double withoutTriangle(const Vector3& x, std::uint32_t slot) const;

  /// Returns the sum over all triangles, in the hierarchy's order.
  double exact(const Vector3& x) const;

  /// Returns the estimate of the coarsest level whose error is at most `error` or for which `isEnough(estimate)` holds;
  /// the exact sum if there is no such level.
  template <typename Enough>
  Estimate estimateWithin(const Vector3& x, double error, Enough isEnough) const {
    for (int level = 0; level < kLevels; ++level)
      if (const Estimate found = estimate(x, level); found.error <= error || isEnough(found)) return found;
    return {exact(x), kRounding};
  }

  /// Returns true if the exact sum is above `level`. Uses the coarsest estimate that decides.
  bool isAbove(const Vector3& x, double level = 0.5) const;

  std::size_t bytes() const;

 private:
  /// A run of triangles, and the distance beyond which a Taylor series replaces the sum over them.
  struct Cluster {
    Vector3 center = Vector3::Zero();                     ///< in the hierarchy's local coordinates
    std::array<double, kLevels> squaredFarDistance = {};  ///< distances from the center, by accuracy level
    std::uint32_t next = 0;                               ///< index of the first cluster that is not a part of this one
    std::uint32_t begin = 0, end = 0;                     ///< range of triangle slots
  };

  /// ∫n dA, and the symmetric parts of ∫n⊗d dA (xx, yy, zz, xy, xz, yz) and ∫n⊗d⊗d dA (xxx, yyy, zzz, xxy, xxz, xyy,
  /// yyz, xzz, yzz, xyz), d from the center. The other parts cancel in the series.
  struct Moments {
    Vector3 first = Vector3::Zero();
    std::array<double, 6> second = {};
    std::array<double, 10> third = {};
    double area = 0, radius = 0;  ///< A and r of the error bound

    /// Adds a triangle with corners `v`, relative to the cluster's center.
    void add(const std::array<Vector3, 3>& v);
    /// Returns 4π times the winding number by the series; `toCenter` runs from x to the center.
    double series(const Vector3& toCenter, double squaredDistance) const;
    /// Returns a bound of the truncation error of the winding number.
    double error(double squaredDistance) const;
  };

  void addCluster(std::uint32_t child, std::uint32_t begin, std::uint32_t end);
  void measure(Cluster& cluster, Moments& moments) const;
  std::array<Vector3, 3> corners(std::uint32_t slot) const;
  /// Returns the exact winding number of the triangles in slots [begin, end).
  double sumOver(const Vector3& local, std::uint32_t begin, std::uint32_t end) const;

  const bvh::Hierarchy* hierarchy_ = nullptr;
  std::vector<Cluster> clusters_;  ///< in depth-first order: a cluster precedes its parts
  std::vector<Moments> moments_;   ///< one for each cluster
  std::vector<Vector3> vertices_;  ///< the hierarchy's vertices in its local coordinates
};

}  // namespace hpsdf::sign
