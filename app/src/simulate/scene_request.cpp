#include "simulate/scene_request.h"

namespace hpsdf::app {

std::span<const SceneKind> scenes() {
  const std::vector<std::string> bodies = {"builtin:gear", "builtin:torus", "builtin:box,width=1,height=0.7,depth=0.5"};
  static const std::vector<SceneKind> all = {
      {"bowl",
       "marbles into a bowl with relief (Fig. 1)",
       {.bodies = 1000, .samples = 1000, .ground = "builtin:structured-bowl,cells=160", .targetError = 1e-8},
       12,
       {30, 45}},
      {"helix",
       "a marble down the groove of a bowl (Fig. 9)",
       {.bodies = 1,
        .samples = 1000,
        .ground = "builtin:helix-bowl,cells=143,turns=3,height=0.25,depth=0.13,thickness=0.17",
        .targetError = 1e-7},
       12,
       {30, 55}},
      {"run",
       "a marble down a run, and out of it among bodies (Fig. 8)",
       {.bodies = 6,
        .samples = 3000,
        .ground = "builtin:marble-run,turns=2",
        .meshes = {bodies.front()},
        .targetError = 1e-7},
       16,
       {30, 25}},
      {"poles", "bodies onto 64 poles (Fig. 7)", {.bodies = 800, .samples = 10000, .meshes = bodies}, 25, {30, 30}},
      {"slope",
       "rigid and soft bodies down a slope with obstacles (Fig. 7)",
       {.bodies = 16, .samples = 3000, .meshes = bodies, .targetError = 1e-7},
       10,
       {35, 35}},
      {"cloth",
       "a sheet of cloth over a body (Fig. 1)",
       {.nodes = 10000, .samples = 1000, .ground = "builtin:torus"},
       4,
       {30, 35}}};
  return all;
}

}  // namespace hpsdf::app
