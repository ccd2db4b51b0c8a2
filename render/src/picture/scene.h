#pragma once
// The buffers of a surface's picture with everything that it shows: surface, sections, cells, bodies.

#include <vector>

#include "hpsdf/render/picture_settings.h"
#include "hpsdf/render/renderer.h"

namespace hpsdf::render {

struct Scene {
  SurfaceView view;
  ViewBuffers buffers;
  std::vector<float> lines = {};  ///< how strongly edges of cells cover each sample, 0 to 1; empty without such lines

  /// True if any pixel shows the field.
  bool showsField() const;
};

/// Renders a view of width × height pixels with the picture's samples for each; lines along cells are `lineWidth`
/// pixels wide. Throws `Error` for a camera, an offset or a clipping plane out of range.
Scene renderScene(Renderer& renderer, const Field& field, const SurfacePicture& picture, int width, int height,
                  double lineWidth);

/// The domain's section with a plane, framed for width × height pixels.
SliceView sectionView(const Box& domain, const Plane& plane, int width, int height);

}  // namespace hpsdf::render
