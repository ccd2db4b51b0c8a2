#pragma once
#include <cstddef>
#include <string>

#include "hpsdf/field.h"
#include "hpsdf/render/picture.h"

namespace hpsdf::app {

/// A picture of a simulation at one moment.
struct SimulationShot {
  render::Drawn drawn;
  const Field& field;  ///< field of the ray-traced body, in whose coordinates the picture is drawn; valid during `take`
  const std::string& renderer;  ///< description of the renderer
  double seconds;               ///< simulated time of the picture
  std::size_t contacts;         ///< number of samples, spheres and soft-body nodes that lie in a field
};

}  // namespace hpsdf::app
