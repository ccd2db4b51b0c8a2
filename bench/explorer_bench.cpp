// Times of frames of the explorer by Mesa's software renderer: a slice with all panels after its plane moved, and the
// surface of a mesh of 97,000 faces while it turns and once it rests.

#include <fmt/format.h>

#include <sstream>

#include "commands/commands.h"
#include "explorer/explorer.h"
#include "language/script.h"
#include "scene.h"

namespace hpsdf::bench {
namespace {

/// An explorer that shows a field.
class ShownField {
 public:
  ShownField(const Field& field, const std::string& show) {
    session_.setField({field, "field"});
    run(show + " gl=software");
    app::explorerOf(session_).frame();  // compiles the shaders and measures the jumps between cells
  }

  void run(const std::string& line) { app::runScript(session_, app::parseScript(registry_, "bench", line, {})); }

  /// Draws a frame after each of the lines that `lineOf` returns for the steps 1, 2, 3, …
  template <typename LineOf>
  void timeFrames(benchmark::State& state, int coarseness, LineOf lineOf) {
    int step = 0;
    for ([[maybe_unused]] auto _ : state) {
      run(lineOf(++step));
      benchmark::DoNotOptimize(app::explorerOf(session_).frame(coarseness));
    }
    state.SetLabel(session_.lastRenderer());
  }

 private:
  app::Registry registry_ = app::makeRegistry();
  std::istringstream in_;
  std::ostringstream out_, err_;
  app::Session session_{registry_, {in_, out_, err_}};
};

void explorerSlice(benchmark::State& state) {
  ShownField shown(bunnyField(), "show slice size=1280x720");
  shown.timeFrames(state, 0, [](int step) { return fmt::format("plane offset={}", 0.001 * (step % 500)); });
}

/// Draws the surface as the window does, with the coarseness of the argument: 0 once it rests, more while it turns.
void explorerSurface(benchmark::State& state) {
  ShownField shown(armadilloField(), "show surface size=1400x900 samples=2");
  shown.timeFrames(state, int(state.range(0)), [](int step) { return fmt::format("camera {},20,1.1", step % 360); });
}

BENCHMARK(explorerSlice)->Name("frame/explorer")->UseRealTime()->Unit(benchmark::kSecond);
BENCHMARK(explorerSurface)->Name("frame/surface")->Arg(0)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace hpsdf::bench
