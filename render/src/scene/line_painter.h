#pragma once
// Straight lines in space, drawn over a scene with the parts that the scene hides left out.

#include <algorithm>
#include <vector>

#include "hpsdf/render/view.h"
#include "image/color.h"
#include "image/strokes.h"

namespace hpsdf::render {

/// A straight line in space.
struct SpaceLine {
  Vector3 a, b;
  double fadeLength;  ///< length, in world units, by which the line fades where it is short in the picture
};

/// The appearance of lines in the picture. Lengths in the picture are in multiples of the line width.
struct LineStyle {
  double fullLength = 24;         ///< lines whose `fadeLength` has this length in the picture have their full strength
  double goneLength = 6;          ///< lines of this length or less have the strength `leastStrength`
  float leastStrength = 0;        ///< opacity of the shortest lines; 0 leaves them out
  double farthestStrength = 0.3;  ///< opacity of lines at the far end of the domain; at the near end it is 1
  float hiddenStrength = 0;       ///< share of a line's opacity that is left where something hides it
  double slack = 0;               ///< a line at most this far behind what the buffers show is visible, world units
};

/// Draws lines into buffers that hold the coverage of each pixel.
class LinePainter {
 public:
  /// The camera and the buffers must exist as long as the painter. `lineWidth` is in pixels.
  LinePainter(const Camera& camera, const Box& domain, const ViewBuffers& buffers, double lineWidth, LineStyle style);

  /// Returns false if all edges of a box are too small in the picture or behind the eye.
  bool mayShow(const Box& box) const;

  /// Returns the share of each pixel, 0 to 1, that the lines cover. Lines behind the objects in the buffers are hidden.
  std::vector<float> coverage(const std::vector<SpaceLine>& lines) const;

 private:
  /// A line, its projection to the picture, and its strength.
  struct Projected {
    SpaceLine line;
    PicturePoint from, to;
    float strength = 0;  ///< opacity of the line; 0 for a line that is not drawn
  };

  Projected projected(SpaceLine line) const;
  PixelRect rectOf(const Projected& line) const;
  void paint(const Projected& line, int y0, int y1, std::vector<float>& coverage) const;
  void paintPixel(const Projected& line, const NearPixel& near, std::vector<float>& coverage) const;
  double pixelsAt(double length, double depth) const;

  const Camera& camera_;
  const ViewBuffers& buffers_;
  LineStyle style_;
  bool parallel_;              ///< whether the camera's rays are parallel
  double pixel_;               ///< height of a pixel at depth 1, world units
  double width_;               ///< width of lines, pixels
  double radius_;              ///< distance from a line's middle up to which pixels are covered, pixels
  double nearDepth_;           ///< least depth at which lines are drawn, world units
  double nearest_, farthest_;  ///< least and greatest depth of the domain
};

}  // namespace hpsdf::render
