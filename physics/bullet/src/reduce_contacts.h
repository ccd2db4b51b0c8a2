#pragma once
// Selects a subset of the contacts between two bodies for the solver.

#include <cstddef>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::physics {

/// A contact of two bodies in the solver's form.
struct BodyContact {
  Vector3 onSecond;  ///< point on the second body, in the world
  Vector3 normal;    ///< unit vector out of the second body
  double distance;   ///< distance from `onSecond` to the first body along the normal, negative where they penetrate
};

/// Reduces the contacts to at most `most`. Keeps the deepest contact first, then repeatedly the contact
/// that is farthest from those already kept. The distance of contacts takes both position and normal into
/// account: an angle of one radian between normals counts as the length `size`. Among equally distant
/// contacts the first is kept. A few contacts around the touching area support a body as well as all
/// contacts do.
void reduceContacts(std::size_t most, double size, std::vector<BodyContact>& contacts);

}  // namespace hpsdf::physics
