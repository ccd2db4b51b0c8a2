#include "simulate/simulation.h"

#include <BulletSoftBody/btSoftBody.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cmath>
#include <optional>

#include "console/console.h"
#include "console/long_work.h"
#include "hpsdf/detail/threads.h"
#include "simulate/scene.h"
#include "simulate/studio.h"

namespace hpsdf::app {
namespace {

/// Returns a hash of the positions and orientations of all bodies in the world.
std::uint64_t stateOf(const physics::World& world) {
  std::vector<double> state;
  const auto add = [&](const btVector3& v) { state.insert(state.end(), {v.x(), v.y(), v.z()}); };
  for (std::size_t n = 0; n < world.bodies(); ++n) {
    const btTransform& at = world.body(n).getWorldTransform();
    add(at.getOrigin());
    for (int row = 0; row < 3; ++row) add(at.getBasis()[row]);
  }
  for (std::size_t n = 0; n < world.softBodies(); ++n)
    for (int node = 0; node < world.softBody(n).m_nodes.size(); ++node) add(world.softBody(n).m_nodes[node].m_x);
  return XXH3_64bits(state.data(), state.size() * sizeof(double));
}

void addStep(const physics::StepFigures& step, double size, bool lastSecond, SimulationFigures& figures) {
  figures.seconds += step.seconds;
  figures.querySeconds += step.dispatch.querySeconds;
  figures.solverSeconds += step.solverSeconds;
  figures.longestQuerySeconds = std::max(figures.longestQuerySeconds, step.dispatch.querySeconds);
  figures.penetrating.add(step.dispatch.penetrating);
  figures.touching.add(step.dispatch.contacts);
  figures.size = size;
  figures.deepest = std::max(figures.deepest, step.dispatch.deepest);
  figures.sumOfDeepest += step.dispatch.deepest;
  if (lastSecond) figures.deepestAtEnd = std::max(figures.deepestAtEnd, step.dispatch.deepest);
}

SimulationFigures run(Scene& scene, const std::string& name, std::uint64_t steps, double rate,
                      const SimulationCamera* camera, const Progress& progress) {
  SimulationFigures figures;
  const double framesPerSecond = camera != nullptr ? camera->framesPerSecond : 0;
  std::optional<Studio> studio;
  if (camera != nullptr) studio.emplace(scene, name, camera->look, camera->backend);
  double nextPicture = framesPerSecond > 0 ? 0 : double(steps);  // step before which the next picture is taken
  std::uint64_t pictures = 0;
  const auto takePicture = [&](std::uint64_t step) {
    if (!studio || double(step) < nextPicture) return;
    camera->take(studio->shot());
    nextPicture = std::round(rate / framesPerSecond * double(++pictures));
  };
  for (std::uint64_t step = 0; step < steps; ++step) {
    progress.update("simulating", double(step) / double(steps));
    scene.admit();
    takePicture(step);
    scene.world().step();
    addStep(scene.world().figures(), scene.bodySize(), double(steps - step) <= rate, figures);
  }
  takePicture(steps);
  figures.steps = steps;
  figures.simulated = scene.world().seconds();
  figures.bodies = scene.moving();
  figures.waiting = scene.waiting();
  figures.lost = scene.lost();
  for (std::size_t n = 0; n < scene.world().softBodies(); ++n)
    figures.nodes += std::size_t(scene.world().softBody(n).m_nodes.size());
  figures.state = stateOf(scene.world());
  return figures;
}

}  // namespace

SimulationFigures simulate(const Console& console, const std::string& scene, const SceneRequest& request,
                           double seconds, int threads, const SimulationCamera* camera) {
  return withThreads(threads, [&] {
    const auto start = std::chrono::steady_clock::now();
    const std::unique_ptr<Scene> made = makeScene(console, scene, request);
    const double setUpSeconds = secondsSince(start);
    const auto steps = std::max<std::uint64_t>(1, std::uint64_t(std::llround(seconds / request.step)));
    SimulationFigures figures = withProgress(console, [&](const Progress& progress) {
      return run(*made, scene, steps, 1 / request.step, camera, progress);
    });
    figures.setUpSeconds = setUpSeconds;
    return figures;
  });
}

}  // namespace hpsdf::app
