#pragma once

#include <cstddef>
#include <vector>

#include "distance/hierarchy.h"

namespace hpsdf::distance {

/// The sides of triangles that no neighbour takes back: the rims of holes, and edges at which faces look the wrong way.
///
/// They alone tell how the winding number changes from place to place, beside the surface: its gradient is the magnetic
/// field of a current that runs along them (Biot and Savart), as a solid angle changes with the outline alone. A closed
/// mesh has none, and a winding number that is the same everywhere up to the surface.
class HoleRims {
 public:
  HoleRims() = default;
  explicit HoleRims(const Hierarchy& hierarchy);

  bool empty() const { return sides_.empty(); }
  std::size_t size() const { return sides_.size(); }

  /// Of the winding number, in the hierarchy's local coordinates, as are all here.
  Vector3 gradient(const Vector3& local) const;

  /// No gradient is longer within so much of a place; infinite where a rim may be there.
  double greatestGradient(const Vector3& local, double within) const;

  std::size_t bytes() const { return sides_.size() * sizeof(Side); }

 private:
  struct Side {
    Vector3 from, to;
    double times;  ///< as many triangles more run this way than the other
  };
  std::vector<Side> sides_;
};

}  // namespace hpsdf::distance
