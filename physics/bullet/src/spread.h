#pragma once

#include <cstddef>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::physics {

/// A contact of two bodies as the solver takes it.
struct BodyContact {
  Vector3 onSecond;  ///< in the world: the point on the second body
  Vector3 normal;    ///< unit, out of the second body
  double distance;   ///< to the first body along the normal, negative where they penetrate
};

/// Leaves at most so many contacts: the deepest, and then always the one that is farthest from those already chosen,
/// by place and by normal (a turn by one radian counts like `size`), the earlier one of equals. A few that surround
/// what touches hold a body as well as all of them.
void spread(std::size_t most, double size, std::vector<BodyContact>& contacts);

}  // namespace hpsdf::physics
