#pragma once
// The key to a view's colours: the colour of each sample, the legend that explains the colours, and the colour
// scale.

#include <functional>
#include <string>

#include "coloring/color_view.h"
#include "hpsdf/render/picture_settings.h"
#include "picture/legend.h"

namespace hpsdf::render {

struct ColorKey {
  SampleColor color;  ///< colour of each sample; may refer to the buffers
  /// The colour of a whole cell; empty for quantities that vary within cells.
  std::function<LinearColor(const Cell&)> cellColor = {};
  Legend legend = {};  ///< the legend in the panel, as data
  ScaleOptions scale;  ///< the given options, with the limits and levels that were chosen
  std::string name;    ///< short name of the shown quantity for a caption, e.g. "degree"
  std::string range;   ///< range of a quantity's values in a caption; empty for degrees and depths
};

/// Makes the key to colours by degree, depth or a quantity, and adds its legend to the overlay. `pointAt(x, y)`
/// returns the point of a sample. Throws `Error` if the limits in the options make no valid scale.
ColorKey makeColorKey(Overlay& overlay, const Frame& frame, const Field& field, const FieldStatistics& figures,
                      const ViewBuffers& buffers, const std::function<Vector3(int, int)>& pointAt, ColorBy color,
                      const ScaleOptions& scale, const ReferenceData& reference);

/// Chooses the scale of the distances in a slice. Throws `Error` if the limits in the options make no valid
/// scale.
DistanceScale distanceScaleFor(const ViewBuffers& buffers, const ScaleOptions& options);

Legend distanceLegend(const DistanceScale& scale, const ColorMap& map);

}  // namespace hpsdf::render
