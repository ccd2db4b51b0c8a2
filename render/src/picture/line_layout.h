#pragma once
// The layout of a line plot: its charts, curves, boxes and texts. It is computed before painting, so that tests can
// check it.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "hpsdf/detail/line.h"
#include "picture/legend.h"

namespace hpsdf::render {

/// A polyline through points in pixels, clipped to a rectangle.
struct CurveItem {
  std::vector<Eigen::Vector2d> points;
  double width;
  Color color;
  PixelRect within;
};

/// The layout of a line plot. The curves are painted over the overlay.
struct LineLayout {
  Overlay overlay;
  std::vector<PixelRect> charts;  ///< from top to bottom
  std::vector<CurveItem> curves;
};

/// Lays out the plot of a field along a line. `exact` holds the exact distance at each sample of the line, or
/// is empty.
LineLayout layOutLine(const Frame& frame, const Field& field, const Line& line, std::span<const double> exact);

/// Blends an anti-aliased curve over the image.
void paintCurve(Image& image, const CurveItem& curve);

}  // namespace hpsdf::render
