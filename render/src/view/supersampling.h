#pragma once
// Several samples of a surface for each pixel, of which only those are traced that one ray per pixel does not tell.

#include "hpsdf/render/renderer.h"

namespace hpsdf::render {

/// Returns the buffers of a surface with samples × samples samples for each of width × height pixels. First traces a
/// ray through the middle of each pixel. Where it and its eight neighbours show an even piece of the surface, or all of
/// them nothing, the samples of the pixel are interpolated between these rays. All samples of the other pixels are
/// traced. If `showsCells` is true, an even piece lies in one cell and has no crack, so that cells and cracks have
/// sharp borders in the buffers; otherwise a sample may have the cell of the middle of its pixel, and cracks narrower
/// than a twentieth of a pixel may be lost. Parts that pass between the rays are missed. Throws `Error` as
/// `Renderer::surface` does.
ViewBuffers supersampledSurface(Renderer& renderer, const SurfaceView& view, int width, int height, int samples,
                                bool showsCells);

}  // namespace hpsdf::render
