#pragma once
#include <cstddef>
#include <string>

#include "hpsdf/field.h"
#include "hpsdf/render/picture.h"

namespace hpsdf::app {

/// A picture of a simulation at one moment.
struct SimulationShot {
  render::Drawn drawn;
  const Field& field;  ///< field of the traced surface, in whose coordinates the picture is; valid during `take`
  const std::string& renderer;  ///< description of the renderer
  double seconds;               ///< simulated time
  std::size_t contacts;         ///< number of surface samples that lie in another body
};

}  // namespace hpsdf::app
