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

/// Statistics of a quantity that is counted once in every step of a simulation.
struct CountPerStep {
  double sum = 0;
  std::size_t most = 0, last = 0;

  void add(std::size_t count) {
    sum += double(count);
    most = std::max(most, count);
    last = count;
  }
};

/// Results of a whole simulation. A contact is a sample point, a sphere or a node of a soft body that lies inside a
/// field's surface.
struct SimulationFigures {
  std::size_t bodies = 0, nodes = 0;  ///< number of moving bodies and of nodes of soft bodies
  std::size_t waiting = 0;            ///< number of bodies that were never added
  std::size_t lost = 0;               ///< number of bodies below the floor at the end
  std::uint64_t steps = 0;
  double simulated = 0;  ///< simulated time, seconds
  /// Wall-clock times in seconds, in this order: setting up the simulation, all steps, all field queries, the physics
  /// solver, and the field queries of the step in which they took longest.
  double setUpSeconds = 0, seconds = 0, querySeconds = 0, solverSeconds = 0, longestQuerySeconds = 0;
  CountPerStep penetrating, touching;  ///< contacts found, and contacts passed to the solver
  double size = 0;  ///< reference length for depths: a marble's radius, a body's size or a cloth's margin
  double deepest = 0, sumOfDeepest = 0,
         deepestAtEnd = 0;  ///< penetration depths, world units; `deepestAtEnd` covers the last second
  std::uint64_t state = 0;  ///< hash of all positions at the end
};

/// The camera that takes the pictures of a simulation. It does not influence the simulation.
struct SimulationCamera {
  /// Camera, picture size and samples per pixel. The camera's distance is a multiple of the distance at which the whole
  /// scene is just in view. A camera without a target looks at the middle of the scene.
  render::SurfacePicture look;
  Backend backend;
  double framesPerSecond = 0;                ///< frames per simulated second; 0 for a single picture at the end
  std::function<void(SimulationShot)> take;  ///< called with each picture
};

/// Simulates a scene for `seconds` of simulated time and takes pictures if there is a camera. Throws `Error`
/// for a scene that cannot be made or simulated, and if the program was built without Bullet. Throws
/// `Cancelled` after Ctrl-C.
SimulationFigures simulate(const Console& console, const std::string& scene, const SceneRequest& request,
                           double seconds, int threads, const SimulationCamera* camera = nullptr);

}  // namespace hpsdf::app
