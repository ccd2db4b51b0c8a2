#include "simulate/simulation.h"

#include <BulletSoftBody/btSoftBody.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cmath>

#include "long_work.h"
#include "simulate/scene.h"

namespace hpsdf::app {
namespace {

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
  figures.penetrating += double(step.dispatch.penetrating);
  figures.mostPenetrating = std::max(figures.mostPenetrating, step.dispatch.penetrating);
  figures.lastPenetrating = step.dispatch.penetrating;
  figures.touching += double(step.dispatch.contacts);
  figures.mostTouching = std::max(figures.mostTouching, step.dispatch.contacts);
  figures.lastTouching = step.dispatch.contacts;
  figures.size = size;
  figures.deepest = std::max(figures.deepest, step.dispatch.deepest);
  figures.sumOfDeepest += step.dispatch.deepest;
  if (lastSecond) figures.deepestAtEnd = std::max(figures.deepestAtEnd, step.dispatch.deepest);
}

SimulationFigures run(Scene& scene, std::uint64_t steps, double rate, const Progress& progress) {
  SimulationFigures figures;
  for (std::uint64_t step = 0; step < steps; ++step) {
    if (progress.cancelled()) throw Cancelled();
    progress.report("simulating", double(step) / double(steps));
    scene.step();
    addStep(scene.world().figures(), scene.bodySize(), double(steps - step) <= rate, figures);
  }
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
                           double seconds, int threads) {
  // asked for more than it may have, TBB would complain on stderr
  const int most = int(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  tbb::task_arena arena(threads > 0 ? std::min(threads, most) : tbb::task_arena::automatic);
  return arena.execute([&] {
    const auto start = std::chrono::steady_clock::now();
    const std::unique_ptr<Scene> made = makeScene(console, scene, request);
    const double setUpSeconds = secondsSince(start);
    const auto steps = std::max<std::uint64_t>(1, std::uint64_t(std::llround(seconds / request.step)));
    SimulationFigures figures =
        withProgress(console, [&](const Progress& progress) { return run(*made, steps, 1 / request.step, progress); });
    figures.setUpSeconds = setUpSeconds;
    return figures;
  });
}

}  // namespace hpsdf::app
