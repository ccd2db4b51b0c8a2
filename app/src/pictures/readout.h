#pragma once
// What is known of the field at a point of a picture.

#include <optional>
#include <string>
#include <vector>

#include "hpsdf/render/picture.h"
#include "session/session.h"

namespace hpsdf::app {

struct Readout {
  render::Pick pick;
  Vector3 gradient;
  double value;                  ///< f by a query, in double precision
  std::optional<double> exact;   ///< where the exact distance is known
  Jump valueJump, gradientJump;  ///< across the cell's nearest face
  double toFace;                 ///< distance to that face, world units
};

Readout readoutAt(const Field& field, const Jumps& jumps, const DistanceFunction* exact, const render::Pick& pick);

/// Of the current field; measures its jumps when they are not known yet.
Readout readoutAt(Session& session, const render::Pick& pick);

/// Two lines.
std::vector<std::string> readoutText(const Readout& readout);

}  // namespace hpsdf::app
