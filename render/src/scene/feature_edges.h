#pragma once
// The lines along which a surface bends sharply, or ends before something farther away.

#include <vector>

#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Returns the share of each sample, 0 or 1, that feature edges cover: places where neighbouring samples show normals
/// more than 30° apart, where one surface ends in front of another, and the outline before the backdrop. `lineWidth` is
/// in samples.
std::vector<float> featureEdges(const SurfaceView& view, const ViewBuffers& buffers, double lineWidth);

}  // namespace hpsdf::render
