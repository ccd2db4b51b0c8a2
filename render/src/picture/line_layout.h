#pragma once
// What a plot of a line consists of, laid out before it is painted, so that tests can look at it.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "hpsdf/detail/line.h"
#include "picture/legend.h"

namespace hpsdf::render {

/// A bent line through points in pixels, cut off at the edges of a rectangle.
struct CurveItem {
  std::vector<Eigen::Vector2d> points;
  double width;
  Color color;
  PixelRect within;
};

/// The curves are painted over the overlay.
struct LineLayout {
  Overlay overlay;
  std::vector<PixelRect> charts;  ///< from the top
  std::vector<CurveItem> curves;
};

LineLayout layOutLine(const Frame& frame, const Field& field, const Line& line, std::span<const double> exact);

void paintCurve(Image& image, const CurveItem& curve);

}  // namespace hpsdf::render
