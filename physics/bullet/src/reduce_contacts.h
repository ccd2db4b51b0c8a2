#pragma once
// A subset of two bodies' contacts for the solver.

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

/// Reduces the contacts to at most `most`: first the deepest one, then repeatedly the contact that is farthest
/// from those already chosen, by position and normal (an angle of one radian counts as the length `size`). Among
/// equals the first is chosen. A few contacts around the touching area support a body as well as all of them.
void reduceContacts(std::size_t most, double size, std::vector<BodyContact>& contacts);

}  // namespace hpsdf::physics
