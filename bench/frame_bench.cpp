// Time of a sphere-traced frame of the bunny by Mesa's software renderer, and by a graphics card if there is one, after
// the field was uploaded. The time includes reading the buffers of the frame back.

#include <memory>

#include "hpsdf/render/picture.h"
#include "hpsdf/render/renderer.h"
#include "hpsdf/render/view.h"
#include "scene.h"

namespace hpsdf::bench {
namespace {

std::unique_ptr<render::Renderer> rendererOf(const Field& field, render::GlChoice choice, benchmark::State& state) {
  try {
    return render::makeGlRenderer(field, choice);
  } catch (const render::GlError& error) {
    state.SkipWithError(error.what());
    return nullptr;
  }
}

void frame(benchmark::State& state, const Field& field, render::GlChoice choice, int width, int height) {
  const auto renderer = rendererOf(field, choice, state);
  if (!renderer) return;
  const render::SurfaceView view{.camera = render::cameraOf({}, field.domain(), width, height)};
  renderer->surface(view, width, height);  // compiles the shaders
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(renderer->surface(view, width, height));
  state.SetLabel(renderer->description());
}

/// Draws whole pictures of the bunny, with or without the shadows that the field measures.
void picture(benchmark::State& state, bool shadows) {
  const auto renderer = rendererOf(bunnyField(), render::GlChoice::software, state);
  if (!renderer) return;
  render::SurfacePicture picture;
  picture.shadows = shadows;
  render::draw(*renderer, bunnyField(), picture);  // compiles the shaders
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(render::draw(*renderer, bunnyField(), picture));
}

void bunnyFrame(benchmark::State& state) { frame(state, bunnyField(), render::GlChoice::software, 1280, 720); }
void floatFrame(benchmark::State& state) { frame(state, floatBunnyField(), render::GlChoice::software, 1280, 720); }
void bunnyFrameByHardware(benchmark::State& state) {
  frame(state, bunnyField(), render::GlChoice::hardware, int(state.range(0)), int(state.range(1)));
}

BENCHMARK(bunnyFrame)->Name("frame/bunny")->UseRealTime()->Unit(benchmark::kSecond);
BENCHMARK(floatFrame)->Name("frame/float")->UseRealTime()->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(picture, shadows, true)->Name("frame/shadows")->UseRealTime()->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(picture, plain, false)->Name("frame/plain")->UseRealTime()->Unit(benchmark::kSecond);
BENCHMARK(bunnyFrameByHardware)
    ->Name("frame_by_hardware/bunny")
    ->Args({1280, 720})
    ->Args({3840, 2160})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace hpsdf::bench
