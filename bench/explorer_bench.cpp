// Time of a frame of the explorer (slice and all panels) by Mesa's software renderer, after the slice plane moved.

#include <fmt/format.h>

#include <sstream>

#include "commands/commands.h"
#include "explorer/explorer.h"
#include "language/script.h"
#include "scene.h"

namespace hpsdf::bench {
namespace {

void explorerFrame(benchmark::State& state) {
  const app::Registry registry = app::makeRegistry();
  std::istringstream in;
  std::ostringstream out, err;
  app::Session session(registry, {in, out, err});
  session.setField({bunnyField(), "bunny"});
  const auto run = [&](const std::string& line) {
    app::runScript(session, app::parseScript(registry, "bench", line, {}));
  };
  run("show slice size=1280x720 gl=software");
  explorerOf(session).frame();  // compiles the shaders and measures the jumps between cells
  int step = 0;
  for ([[maybe_unused]] auto _ : state) {
    run(fmt::format("plane offset={}", 0.001 * (++step % 500)));
    benchmark::DoNotOptimize(explorerOf(session).frame());
  }
  state.SetLabel(session.lastRenderer());
}

BENCHMARK(explorerFrame)->Name("frame/explorer")->UseRealTime()->Unit(benchmark::kSecond);

}  // namespace
}  // namespace hpsdf::bench
