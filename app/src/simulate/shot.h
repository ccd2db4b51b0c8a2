#pragma once
// A picture of a simulation.

#include <cstddef>
#include <string>

#include "hpsdf/field.h"
#include "hpsdf/render/picture.h"

namespace hpsdf::app {

/// A picture of a simulation.
struct SimulationShot {
  render::Drawn drawn;
  const Field& field;  ///< whose surface and coordinates it has; good while it is taken
  const std::string& renderer;
  double seconds;  ///< simulated
  std::size_t contacts;
};

}  // namespace hpsdf::app
