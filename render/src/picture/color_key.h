#pragma once
// The meaning of a view's colours: the colour of each sample, the panel that explains them, and the scale.

#include <functional>
#include <string>

#include "coloring/color_view.h"
#include "hpsdf/render/picture_settings.h"
#include "picture/legend.h"

namespace hpsdf::render {

struct ColorKey {
  SampleColor color;   ///< may refer to the buffers
  Legend legend = {};  ///< content of the panel, as data
  ScaleOptions scale;  ///< the settings' scale with the limits and levels that were chosen
  std::string name;    ///< name of the colours' meaning in a caption
  std::string range;   ///< range of a quantity's values in a caption; empty for degrees and depths
};

/// The key to colours by degree, depth or a quantity; adds its panel to the overlay. `pointAt(x, y)` returns the point
/// of a sample. Throws `Error` for limits that make no scale.
ColorKey makeColorKey(Overlay& overlay, const Frame& frame, const Field& field, const FieldStatistics& figures,
                      const ViewBuffers& buffers, const std::function<Vector3(int, int)>& pointAt, ColorBy color,
                      const ScaleOptions& scale, const ReferenceData& reference);

/// The scale of the distances in a slice. Throws `Error` for limits that make no scale.
DistanceScale distanceScaleFor(const ViewBuffers& buffers, const ScaleOptions& options);

Legend distanceLegend(const DistanceScale& scale);

}  // namespace hpsdf::render
