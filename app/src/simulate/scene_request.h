#pragma once
// The paper's simulations (sec. 4, Figs. 1, 7, 8, 9), as far as they can be asked for without Bullet at hand.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hpsdf::app {

struct SceneRequest {
  std::size_t bodies = 0;                           ///< that move; some of the slope's are soft
  std::size_t nodes = 0;                            ///< of cloth, at least
  std::size_t samples = 0;                          ///< of each kind of body
  std::string ground = {};                          ///< what all else falls on, where the scene takes one
  std::vector<std::string> meshes = {};             ///< of the bodies, where the scene takes some
  bool filesAreYUp = true;                          ///< which way is up in mesh files; shapes have z
  double targetError = 1e-6;                        ///< τ of the fields
  std::optional<std::filesystem::path> cache = {};  ///< folder for the fields
  std::uint64_t seed = 1;
  double step = 1.0 / 240;  ///< seconds
  int iterations = 20;      ///< of the solver
};

struct SceneKind {
  std::string name;
  std::string help;
  SceneRequest defaults;
  double seconds;
  std::array<double, 2> view;  ///< azimuth and elevation in degrees, from where one sees what happens
};

/// All of them.
std::span<const SceneKind> scenes();

}  // namespace hpsdf::app
