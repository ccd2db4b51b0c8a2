#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bvh/hierarchy.h"
#include "sign/angle_block.h"

namespace hpsdf::sign {

/// The generalised winding number of a hierarchy's triangles about a point (Jacobson, Kavan and
/// Sorkine-Hornung 2013). It is a whole number if the mesh is closed, and any real number if the mesh has
/// holes.
///
/// The winding number at x is (1/4π) ∫ n·(q − x)/|q − x|³ dS over the points q of the surface with normal n. A cluster
/// of triangles that is far enough from x is replaced by the Taylor series of the integrand about the cluster's
/// center, up to second order (Barill et al. 2018). Let R be the distance from x to the center, r the greatest
/// distance of the cluster's triangles from the center, and d = q − center. The truncation error is at most
///
///   A/(4πR²) · (1/(1−t)² − 1 − 2t − 3t²)  with t = r/R and A = ∫ (|d|/r)³ dS.
///
/// This bound holds because the integrand is a derivative of 1/|q − x|. In the Taylor series of 1/|q − x|, the term of
/// degree l in d is a solid harmonic, and the length of its gradient is at most l |d|^(l−1)/R^(l+1). The series
/// contains the terms up to l = 3.
class WindingNumber {
 public:
  WindingNumber() = default;

  /// Computes the moments of all clusters. Keeps a pointer to the hierarchy, which must not be moved or destroyed
  /// before this object.
  explicit WindingNumber(const bvh::Hierarchy& hierarchy);

  struct Estimate {
    double value = 0;
    double error = 0;  ///< bound of the difference between `value` and the exact sum
  };

  /// Bound of the rounding error of a sum of up to `Hierarchy::kMaxTriangles` solid angles.
  static constexpr double kRounding = 1e-7;

  /// Number of accuracy levels; level 0 is the coarsest and cheapest.
  static constexpr int kLevels = 4;
  Estimate estimate(const Vector3& x, int level) const;

  /// Returns the winding number without the contribution of one triangle, to within 0.05.
  double withoutTriangle(const Vector3& x, std::uint32_t slot) const;

  /// Returns the winding number as the exact sum over all triangles, in the hierarchy's order.
  double exact(const Vector3& x) const;

  /// Returns the first estimate, from the coarsest accuracy level on, whose error is at most `error` or that satisfies
  /// `isEnough(estimate)`. If there is none, returns the exact sum.
  template <typename Enough>
  Estimate estimateWithin(const Vector3& x, double error, Enough isEnough) const {
    for (int level = 0; level < kLevels; ++level)
      if (const Estimate found = estimate(x, level); found.error <= error || isEnough(found)) return found;
    return {exact(x), kRounding};
  }

  /// Returns true if the exact winding number is above `level`. Uses the coarsest estimate whose error is
  /// small enough to decide this.
  bool isAbove(const Vector3& x, double level = 0.5) const;

  std::size_t bytes() const;

 private:
  /// A contiguous range of triangles, with the distance beyond which a Taylor series replaces the sum over
  /// these triangles.
  struct Cluster {
    Vector3 center = Vector3::Zero();                     ///< in the hierarchy's local coordinates
    std::array<double, kLevels> squaredFarDistance = {};  ///< square of the least distance for the series, by level
    std::uint32_t next = 0;                               ///< index of the next cluster that is not a part of this one
    std::uint32_t begin = 0, end = 0;                     ///< range of triangle slots
    std::uint32_t block = 0;                              ///< for a cluster that is not divided: its index in `blocks_`
  };

  /// The moments of a cluster, where n is the normal of the surface and d runs from the cluster's center to the
  /// surface: ∫n dS, and the symmetric parts of ∫n⊗d dS (xx, yy, zz, xy, xz, yz) and ∫n⊗d⊗d dS (xxx, yyy, zzz, xxy,
  /// xxz, xyy, yyz, xzz, yzz, xyz). The other parts of these tensors cancel in the Taylor series.
  struct Moments {
    Vector3 first = Vector3::Zero();
    std::array<double, 6> second = {};
    std::array<double, 10> third = {};
    double area = 0, radius = 0;  ///< A and r in the error bound of `WindingNumber`

    /// Adds the moments of a triangle whose corners `v` are relative to the cluster's center.
    void add(const std::array<Vector3, 3>& v);
    /// Returns 4π times the cluster's contribution to the winding number, by the Taylor series. `toCenter` runs
    /// from the point x to the cluster's center.
    double series(const Vector3& toCenter, double squaredDistance) const;
    /// Returns a bound of the truncation error of the cluster's contribution to the winding number.
    double error(double squaredDistance) const;
  };

  void addCluster(std::uint32_t child, std::uint32_t begin, std::uint32_t end);
  void fill(AngleBlock& block, const Cluster& cluster) const;
  void measure(Cluster& cluster, Moments& moments) const;
  /// Returns the corners of a triangle in local coordinates.
  std::array<Vector3, 3> corners(std::uint32_t slot) const;

  const bvh::Hierarchy* hierarchy_ = nullptr;
  std::vector<Cluster> clusters_;   ///< in depth-first order: a cluster precedes the clusters into which it is divided
  std::vector<Moments> moments_;    ///< one for each cluster
  std::vector<AngleBlock> blocks_;  ///< the triangles of the hierarchy's blocks in local coordinates
};

}  // namespace hpsdf::sign
