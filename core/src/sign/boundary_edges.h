#pragma once
// The winding number's gradient, by clusters of sides.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bvh/hierarchy.h"
#include "mesh/directed_edges.h"

namespace hpsdf::distance {

/// The sides of triangles that no neighbour takes back: the rims of holes, and edges at which faces look the wrong way.
///
/// They alone tell how the winding number changes from place to place, beside the surface: its gradient is the magnetic
/// field of a current that runs along them, 1/4π ∫ r/|r|³ × dl, r from the place to the side (Biot and Savart), as a
/// solid angle changes with the outline alone. A closed mesh has none, and a winding number that is the same everywhere
/// up to the surface.
///
/// For a cluster of sides that is far enough away, the Taylor series of r/|r|³ about the cluster's center is taken, up
/// to second order. Of a cluster within r of its center, R away, what is left out is at most
///
///   B/4πR⁵ (4 − 3t)/(1 − t)²,  t = r/R,  B = ∫ |d|³ dl, d from the center,
///
/// by the solid harmonics of `Winding`: the sum of l |d|^(l−1)/R^(l+1) from l = 4 on.
class BoundaryEdges {
 public:
  BoundaryEdges() = default;
  explicit BoundaryEdges(const Hierarchy& hierarchy);
  /// `sides`: of the hierarchy's triangles.
  BoundaryEdges(const Hierarchy& hierarchy, const std::vector<hpsdf::Side>& sides);

  bool empty() const { return sides_.empty(); }
  std::size_t size() const { return sides_.size(); }

  /// Of the winding number. Places and lengths are the hierarchy's local ones.
  struct Gradient {
    Vector3 value = Vector3::Zero();
    double error = 0;           ///< so far from the exact sum at most
    double change = 0;          ///< so much it changes at most, a way, beside here
    double nearest = HUGE_VAL;  ///< no rim is nearer
    std::size_t terms = 0;      ///< so many sides, and clusters in place of theirs, were summed
  };

  /// By clusters so coarse that its error is no more than this, at least 0; with 0, the sum itself.
  Gradient gradient(const Vector3& local, double error) const;

  std::size_t bytes() const { return sides_.size() * sizeof(Side) + clusters_.size() * sizeof(Cluster); }

 private:
  struct Side {
    Vector3 from, to;
    double times;  ///< as many triangles more run this way than the other

    /// 4π times its share, and what it does to the bounds.
    void addTo(Gradient& sum, const Vector3& local) const;
  };

  /// Sides [begin, end), and ∫dl, ∫d⊗dl and, for each component of dl, ∫d⊗d dl, times and direction included.
  struct Cluster {
    std::uint32_t begin = 0, end = 0;
    std::uint32_t next = 0;  ///< the cluster that comes when this one is done
    Vector3 center = Vector3::Zero();
    double radius = HUGE_VAL;  ///< r above; until measured, no place is far enough away
    double cubes = 0;          ///< B above
    double length = 0;         ///< ∫dl
    Vector3 first = Vector3::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    std::array<Eigen::Matrix3d, 3> third = {second, second, second};

    void add(const Side& side);
    /// 4π times the series, `toCenter` from the place.
    Vector3 at(const Vector3& toCenter, double squaredDistance) const;
  };

  void cluster(std::uint32_t begin, std::uint32_t end);
  void measure(Cluster& cluster) const;
  /// By clusters of which t above is less than this.
  Gradient sum(const Vector3& local, double ratio) const;

  std::vector<Side> sides_;
  std::vector<Cluster> clusters_;  ///< a cluster before those that it is made of
};

}  // namespace hpsdf::distance
