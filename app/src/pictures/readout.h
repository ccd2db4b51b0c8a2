#pragma once
// Values of a field at the point that a pixel of a picture shows.

#include <optional>
#include <string>
#include <vector>

#include "hpsdf/render/picture.h"
#include "session/session.h"

namespace hpsdf::app {

struct Readout {
  render::Pick pick;
  Vector3 gradient;
  double value;                  ///< value of the field at the point, in double precision
  std::optional<double> exact;   ///< exact distance, if known
  Jump valueJump, gradientJump;  ///< jumps across the cell face nearest to the point
  double toFace;                 ///< distance from the point to the nearest face of its cell, world units
};

Readout readoutAt(const Field& field, const Jumps& jumps, const DistanceFunction* exact, const render::Pick& pick);

/// Returns the values of the session's current field at the picked point. Measures the jumps of the field if that has
/// not been done yet.
Readout readoutAt(Session& session, const render::Pick& pick);

/// Formats the readout as two lines of text.
std::vector<std::string> readoutText(const Readout& readout);

}  // namespace hpsdf::app
