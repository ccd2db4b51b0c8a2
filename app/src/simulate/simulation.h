#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>

#include "hpsdf/field.h"
#include "hpsdf/render/picture.h"
#include "session/backend.h"
#include "session/session.h"
#include "simulate/scene_request.h"
#include "simulate/shot.h"

namespace hpsdf::app {

/// A number that each step has.
struct CountAStep {
  double sum = 0;
  std::size_t most = 0, last = 0;

  void add(std::size_t count) {
    sum += double(count);
    most = std::max(most, count);
    last = count;
  }
};

/// Of a whole simulation. Contacts are samples, spheres and nodes of soft bodies that lie in a field.
struct SimulationFigures {
  std::size_t bodies = 0, nodes = 0;  ///< that move
  std::size_t waiting = 0;            ///< bodies that would have come later
  std::size_t lost = 0;               ///< at the end
  std::uint64_t steps = 0;
  double simulated = 0;  ///< seconds
  double setUpSeconds = 0, seconds = 0, querySeconds = 0, solverSeconds = 0, longestQuerySeconds = 0;
  CountAStep penetrating, touching;  ///< touching are the solver's contacts
  double size = 0;  ///< what depths are compared with: the radius of a marble, the size of a body, a cloth's margin
  double deepest = 0, sumOfDeepest = 0, deepestAtEnd = 0;  ///< the last of the simulation's last second
  std::uint64_t state = 0;                                 ///< a fingerprint of all places at the end
};

/// How a simulation is drawn: it goes on as if it were not.
struct SimulationCamera {
  /// Camera, size and samples. The camera's distance is a multiple of that at which all of the scene is just in view,
  /// and it circles the scene's middle where it has no target.
  render::SurfacePicture look;
  Backend backend;
  double framesPerSecond = 0;  ///< simulated ones, the start first; 0: one picture, of the end
  std::function<void(SimulationShot)> take;
};

/// Runs a scene, and takes pictures of it where there is a camera. Throws `Error` for what cannot be made or simulated,
/// and in a program that was built without Bullet; `Cancelled` after Ctrl-C.
SimulationFigures simulate(const Console& console, const std::string& scene, const SceneRequest& request,
                           double seconds, int threads, const SimulationCamera* camera = nullptr);

}  // namespace hpsdf::app
