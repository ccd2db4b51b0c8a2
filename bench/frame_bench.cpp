// Time of a sphere-traced frame of the bunny by Mesa's software renderer, after the field was uploaded.

#include "hpsdf/render/renderer.h"
#include "hpsdf/render/view.h"
#include "scene.h"

namespace hpsdf::bench {
namespace {

void bunnyFrame(benchmark::State& state) {
  const Field& field = bunnyField();
  const auto renderer = render::makeGlRenderer(field, render::GlChoice::software);
  const render::SurfaceView view{.camera = render::cameraOf({}, field.domain(), 1280, 720)};
  renderer->surface(view, 1280, 720);  // compiles the shaders
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(renderer->surface(view, 1280, 720));
  state.SetLabel(renderer->description());
}

BENCHMARK(bunnyFrame)->Name("frame/bunny")->UseRealTime()->Unit(benchmark::kSecond);

}  // namespace
}  // namespace hpsdf::bench
