#pragma once
// The layout of a line plot: its charts, curves, boxes and texts. It is computed before painting, so that tests can
// check it.

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "hpsdf/detail/line.h"
#include "picture/legend.h"

namespace hpsdf::render {

/// The colours of curves and of the borders between cells. They differ in lightness as well as in hue, for colour-blind
/// readers and for print.
constexpr std::array<Color, 4> kCurveColors = {{{3, 68, 132}, {235, 158, 29}, {187, 57, 81}, {154, 159, 174}}};
/// The background of a line plot outside of the domain.
constexpr Color kOutsideColor = {238, 238, 240};

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
