#pragma once
// The shadows that bodies throw on each other and on the field's surface.

#include <span>
#include <vector>

#include "hpsdf/render/bodies.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Lessens `lit`, the share of the key light at each sample of `buffers`, where bodies stand between the point and the
/// lamp. The bodies are drawn as the lamp sees them, with parallel rays; a point is in the shadow of what the lamp sees
/// nearer by, and the border of the shadow is soft by a fixed width (Williams, "Casting curved shadows on curved
/// surfaces", 1978; Reeves et al., "Rendering antialiased shadows with depth maps", 1987). `extent` is the length of
/// the scene: bodies that are several times as large, such as level ground, throw no shadow.
void throwShadows(BodyRenderer& renderer, std::span<const Body> bodies, const SurfaceView& view,
                  const ViewBuffers& buffers, const Vector3& toKey, double extent, std::vector<float>& lit);

}  // namespace hpsdf::render
