#pragma once
// The settings of the paper's simulations (sec. 4, Figs. 1, 7, 8, 9). This header does not depend on Bullet.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hpsdf/build_options.h"

namespace hpsdf::app {

struct SceneRequest {
  std::size_t bodies = 0;                   ///< number of moving bodies, including the soft bodies of the slope scene
  std::size_t nodes = 0;                    ///< least number of nodes of the cloth
  std::size_t samples = 0;                  ///< number of surface samples of each kind of body
  std::string ground = {};                  ///< mesh that bodies fall onto; empty in scenes without one
  std::vector<std::string> meshes = {};     ///< meshes of moving rigid bodies other than marbles; may be empty
  bool filesAreYUp = true;                  ///< true if mesh files have y up; shapes always have z up
  double targetError = 1e-6;                ///< target error τ of the fields
  Strategy strategy = Strategy::automatic;  ///< how the fields are refined
  std::optional<std::filesystem::path> cache = {};  ///< folder in which fields are kept between runs
  std::uint64_t seed = 1;                           ///< seed of the random positions and orientations
  double step = 1.0 / 240;                          ///< time step, seconds of simulated time
  int iterations = 20;                              ///< iterations of the constraint solver in each step
};

struct SceneKind {
  std::string name;
  std::string help;
  SceneRequest defaults;
  double seconds;              ///< default duration, seconds of simulated time
  std::array<double, 2> view;  ///< default azimuth and elevation of the camera, degrees
};

/// Returns all kinds of scenes.
std::span<const SceneKind> scenes();

}  // namespace hpsdf::app
