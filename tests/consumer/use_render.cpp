#include <hpsdf/render/renderer.h>

#include <algorithm>
#include <cstdio>

#include "torus_field.h"

// Renders on the CPU, so that the test runs on machines without OpenGL.
int main() {
  constexpr int kSize = 32;
  const hpsdf::Field field = torusField();
  const hpsdf::render::OrbitCamera camera{.elevationDegrees = 90, .up = hpsdf::render::UpAxis::z};
  const auto buffers = hpsdf::render::makeCpuRenderer(field)->surface(
      {.camera = hpsdf::render::cameraOf(camera, field.domain(), kSize, kSize)}, kSize, kSize);

  // The central ray runs along the axis of the torus and passes through its hole.
  const bool hole = !buffers.hit(kSize / 2 * kSize + kSize / 2);
  const auto hits = std::count_if(buffers.cell.begin(), buffers.cell.end(),
                                  [](std::uint32_t cell) { return cell != hpsdf::render::kNoCell; });
  if (hole && hits > kSize * kSize / 10) return 0;
  std::fprintf(stderr, "hole %d, %td pixels hit\n", hole, hits);
  return 1;
}
