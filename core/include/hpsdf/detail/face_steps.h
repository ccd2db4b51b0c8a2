#pragma once
// How far queries on either side of a face disagree.

#include <cstddef>
#include <cstdint>
#include <span>

#include "hpsdf/error.h"
#include "hpsdf/field.h"
#include "hpsdf/jumps.h"

namespace hpsdf {

/// The greatest steps from one side of a face to the other.
struct FaceSteps {
  std::size_t points = 0;
  double value = 0;     ///< of f, in the field's units
  double gradient = 0;  ///< length of the difference of the gradients
};

/// What queries answer on either side of `count` random points of faces: at two points that are neighbours in floating
/// point and lie in different leaves, so that the answers share nothing. Each point lies on a random one of `faces`,
/// which are the field's own (`Jumps::interfaces`): small ones count like large ones. The same seed gives the same
/// figures, whatever the number of `threads` (0: all that the machine offers). Throws `Cancelled` when progress says
/// so.
FaceSteps stepsAcrossFaces(const Field& field, std::span<const Interface> faces, std::size_t count,
                           std::uint64_t seed = 1, int threads = 0, const Progress& progress = {});

}  // namespace hpsdf
