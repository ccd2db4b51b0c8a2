#pragma once

#include <cstddef>
#include <vector>

#include "distance/hierarchy.h"
#include "mesh/sides.h"

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
  /// `sides`: of the hierarchy's triangles.
  HoleRims(const Hierarchy& hierarchy, const std::vector<hpsdf::Side>& sides);

  bool empty() const { return sides_.empty(); }
  std::size_t size() const { return sides_.size(); }

  /// Of the winding number. Places and lengths are the hierarchy's local ones.
  struct Gradient {
    Vector3 value;
    double change = 0;   ///< so much it changes at most, a way, beside here
    double nearest = 0;  ///< so far is the nearest rim
  };
  Gradient gradient(const Vector3& local) const;

  std::size_t bytes() const { return sides_.size() * sizeof(Side); }

 private:
  struct Side {
    Vector3 from, to;
    double times;  ///< as many triangles more run this way than the other
  };
  std::vector<Side> sides_;
};

}  // namespace hpsdf::distance
