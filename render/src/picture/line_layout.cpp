#include "picture/line_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "coloring/color_view.h"
#include "coloring/picture_form.h"
#include "hpsdf/render/line_plot.h"
#include "image/strokes.h"
#include "picture/describe.h"
#include "vector/paths.h"

namespace hpsdf::render {
namespace {

/// Points of a curve; x is the distance along the line, y the value.
using Points = std::vector<Eigen::Vector2d>;

constexpr Color kBlue = kCurveColors[0], kAmber = kCurveColors[1], kRed = kCurveColors[2], kBorder = kCurveColors[3];

// A row of a chart's legend, with one curve or with many short curves.
struct Series {
  std::vector<std::string> names;  // the longest first; the legend shows the first that fits
  Color color;
  bool broad = false;  // drawn as a broad line, which stays visible under a curve of equal values
  std::vector<Points> curves;
};

struct Chart {
  std::vector<std::string> titles;
  double weight;  // height of the chart relative to the other charts
  std::vector<Series> series;
  bool containsZero = false;
};

struct Scale {
  double low, high, step;
};

Points pointsOf(const Line& line, const auto& valueOf) {
  Points points;
  for (std::size_t i = 0; i < line.samples.size(); ++i)
    points.emplace_back(line.samples[i].t * line.length(), valueOf(i));
  return points;
}

Chart valueChart(const Line& line, std::span<const double> exact) {
  Chart chart{{"signed distance", "distance"}, 3, {}};
  if (!exact.empty())
    chart.series.push_back({{"exact"}, kAmber, true, {pointsOf(line, [&](std::size_t i) { return exact[i]; })}});
  chart.series.push_back(
      {{"field f"}, kBlue, false, {pointsOf(line, [&](std::size_t i) { return line.samples[i].value; })}});
  if (line.pieces.size() > 1) chart.series.push_back({{"border of cells", "cell border"}, kBorder, false, {}});
  return chart;
}

Chart errorChart(const Line& line, std::span<const double> exact) {
  const auto error = [&](std::size_t i) { return line.samples[i].value - exact[i]; };
  return {{"error f − exact", "error"}, 2, {{{"f − exact"}, kRed, false, {pointsOf(line, error)}}}, true};
}

Chart jumpChart(const Line& line, const std::vector<LineJump>& jumps) {
  Series stems{{"f after − f before", "after − before", "jump"}, kRed, false, {}};
  for (const LineJump& jump : jumps) {
    const double s = jump.t * line.length();
    stems.curves.push_back({{s, 0}, {s, jump.value}});
  }
  return {{"jump of f at borders", "jump of f", "jump"}, 2, {std::move(stems)}, true};
}

Chart gradientChart(const Line& line) {
  const auto length = [&](std::size_t i) { return line.samples[i].gradient.norm(); };
  const auto slope = [&](std::size_t i) { return line.slopeAlong(line.samples[i]); };
  return {{"gradient"},
          2,
          {{{"|∇f|"}, kAmber, true, {pointsOf(line, length)}},
           {{"slope along line", "slope"}, kBlue, false, {pointsOf(line, slope)}}}};
}

std::vector<Chart> chartsOf(const Line& line, std::span<const double> exact) {
  std::vector<Chart> charts = {valueChart(line, exact)};
  const std::vector<LineJump> jumps = jumpsAlong(line);
  if (!exact.empty())
    charts.push_back(errorChart(line, exact));
  else if (!jumps.empty())
    charts.push_back(jumpChart(line, jumps));
  charts.push_back(gradientChart(line));
  return charts;
}

Scale scaleOf(const Chart& chart, double lines) {
  constexpr double kMargin = 0.06, kFlat = 1e-6;
  double low = chart.containsZero ? 0 : std::numeric_limits<double>::infinity(), high = -low;
  for (const Series& series : chart.series)
    for (const Points& points : series.curves)
      for (const Eigen::Vector2d& point : points) {
        if (!std::isfinite(point.y())) continue;
        low = std::min(low, point.y());
        high = std::max(high, point.y());
      }
  if (!(low <= high)) low = high = 0;
  const double size = std::max(std::abs(low), std::abs(high));
  double margin = kMargin * (high - low);
  // Give a curve that is constant up to rounding a wide margin, so that rounding errors do not look like variation.
  if (!(high - low > kFlat * size)) margin = size > 0 ? 0.05 * size : 1;
  low -= margin;
  high += margin;
  return {low, high, niceStep(high - low, std::max(2.0, lines))};
}

std::vector<double> ticksOf(const Scale& scale) {
  std::vector<double> ticks;
  for (double n = std::ceil(scale.low / scale.step - 1e-9);
       n * scale.step <= scale.high * (1 + 1e-12) + 1e-9 * scale.step; ++n)
    ticks.push_back(n * scale.step);
  return ticks;
}

// Formats the value of a tick with just enough digits to tell it from the values of neighbouring ticks.
std::string tickText(double value, double step) {
  if (std::abs(value) < 1e-9 * step) return "0";
  const int digits = int(std::floor(std::log10(std::abs(value)) + 1e-9) - std::floor(std::log10(step) + 1e-9)) + 1;
  return formatNumber(value, std::clamp(digits, 1, 15));
}

class Plotter {
 public:
  Plotter(const Frame& frame, const Field& field, const Line& line, std::span<const double> exact)
      : frame_(frame),
        field_(field),
        line_(line),
        em_(frame.textSize),
        small_(std::max(kSmallestText, 0.85 * em_)),
        thin_(std::max(1.0, em_ / 15)),
        labelled_(!frame.caption.empty()),
        charts_(chartsOf(line, exact)) {}

  LineLayout draw() {
    layOutGrid();
    shadeOutside();
    for (std::size_t n = 0; n < layout_.charts.size(); ++n) drawGround(layout_.charts[n], scales_[n]);
    drawBands();
    drawBorders();
    for (std::size_t n = 0; n < layout_.charts.size(); ++n) drawCurves(layout_.charts[n], charts_[n], scales_[n]);
    if (labelled_) drawAbscissa();
    for (std::size_t n = 0; n < layout_.charts.size(); ++n) drawLegend(layout_.charts[n], charts_[n]);
    drawCaption();
    return std::move(layout_);
  }

 private:
  void box(double x0, double y0, double x1, double y1, Color color) {
    layout_.overlay.boxes.push_back({x0, y0, x1, y1, color});
  }
  void text(std::string text, double size, double x, double baseline, Color color) {
    addText(layout_.overlay, std::move(text), size, x, baseline, color);
  }

  double xOf(double t) const { return left_ + t * (right_ - left_); }

  void layOutGrid() {
    const PixelRect& view = frame_.view;
    const int margin = labelled_ ? int(std::lround(em_)) : 1;
    const int foot = labelled_ ? int(std::lround(3.2 * em_)) : margin;
    layOutRows(view.y0 + margin, view.y1 - foot);
    for (std::size_t n = 0; n < layout_.charts.size(); ++n)
      scales_.push_back(scaleOf(charts_[n], layout_.charts[n].height() / (2.4 * em_)));
    left_ = view.x0 + margin;
    if (labelled_) left_ = view.x0 + int(std::ceil(widestLabel() + 1.2 * em_));
    // Leave room for the last number of the axis if no legend lies between the charts and the picture's edge.
    right_ = std::max(left_ + 1, view.x1 - int(std::lround(frame_.panel.empty() ? 1.5 * margin : 0.5 * margin)));
    for (auto* rows : {&layout_.charts, &bands_})
      for (PixelRect& row : *rows) row.x0 = left_, row.x1 = right_;
  }

  // Stacks charts and bands from top to bottom. If the charts would be too low to read, omits the bands. If that is not
  // enough, also omits charts, the last one first.
  void layOutRows(int top, int bottom) {
    const int gap = std::max(1, int(std::lround(0.9 * em_))), bandGap = std::max(1, int(std::lround(0.35 * em_)));
    const int band = int(std::lround(1.5 * em_)), least = int(std::lround(2.6 * em_));
    int bands = labelled_ ? 2 * band + bandGap + gap : 0;
    const auto available = [&] { return bottom - top - bands - gap * int(charts_.size() - 1); };
    if (available() < least * int(charts_.size())) bands = 0;
    while (charts_.size() > 1 && available() < least * int(charts_.size())) charts_.pop_back();

    double weights = 0;
    for (const Chart& chart : charts_) weights += chart.weight;
    const int height = std::max(available(), 1);
    int y = top;
    for (const Chart& chart : charts_) {
      const int ownHeight = std::max(1, int(std::floor(height * chart.weight / weights)));
      layout_.charts.push_back({0, y, 0, y + ownHeight});
      y += ownHeight + gap;
    }
    if (bands > 0)
      for (int n = 0; n < 2; ++n, y += band + bandGap) bands_.push_back({0, y, 0, y + band});
    bottom_ = bands_.empty() ? layout_.charts.back().y1 : bands_.back().y1;
  }

  double widestLabel() const {
    double widest = bands_.empty() ? 0 : advanceOf("degree", small_);
    for (const Scale& scale : scales_)
      for (const double tick : ticksOf(scale)) widest = std::max(widest, advanceOf(tickText(tick, scale.step), small_));
    return widest;
  }

  void shadeOutside() {
    for (const Piece& piece : line_.pieces)
      if (!piece.cell) box(xOf(piece.tEnter), layout_.charts.front().y0, xOf(piece.tLeave), bottom_, kOutsideColor);
  }

  static double yOf(const PixelRect& chart, const Scale& scale, double value) {
    return chart.y1 - (value - scale.low) / (scale.high - scale.low) * chart.height();
  }

  // Draws a chart's two axes and its horizontal grid lines with their values. The grid line at zero is darker.
  void drawGround(const PixelRect& chart, const Scale& scale) {
    double lastLabel = std::numeric_limits<double>::infinity();  // baseline of the last number added
    for (const double tick : ticksOf(scale)) {
      const double y = yOf(chart, scale, tick);
      const std::string label = tickText(tick, scale.step);
      box(left_, y - 0.5 * thin_, right_, y + 0.5 * thin_, label == "0" ? kSoftInk : kRule);
      const double baseline = y + capHeight(small_) / 2;
      if (!labelled_ || baseline + 1.3 * small_ > lastLabel) continue;
      text(label, small_, left_ - 0.5 * em_ - advanceOf(label, small_), baseline, kInk);
      lastLabel = baseline;
    }
    box(left_ - thin_, chart.y0, left_, chart.y1, kTick);
    box(left_ - thin_, chart.y1, right_, chart.y1 + thin_, kTick);
  }

  // Draws a vertical line at each border between two cells. The lines are thinner where they are dense, so that
  // they do not hide the curves.
  void drawBorders() {
    for (std::size_t n = 1; n < line_.pieces.size(); ++n) {
      const double x = xOf(line_.pieces[n].tEnter);
      const double room = xOf(line_.pieces[n].tLeave) - xOf(line_.pieces[n - 1].tEnter);
      const double half = 0.5 * std::clamp(0.04 * room, 0.2 * thin_, thin_);
      box(x - half, layout_.charts.front().y0, x + half, bottom_, kBorder);
    }
  }

  void drawBands() {
    if (bands_.empty()) return;
    drawBand(bands_[0], "degree", [](const Cell& cell) { return cell.degree; });
    drawBand(bands_[1], "depth", [](const Cell& cell) { return cell.depth; });
    nameOutside(bands_[0]);
  }

  // Draws the band of degrees or depths below the charts. Its legend contains only the levels of cells on the line.
  void drawBand(const PixelRect& band, const std::string& name, const auto& levelOf) {
    std::set<int> seen;
    for (const Piece& piece : line_.pieces) {
      if (!piece.cell) continue;
      const int level = levelOf(*piece.cell);
      seen.insert(level);
      swatch({xOf(piece.tEnter), double(band.y0), xOf(piece.tLeave), double(band.y1), levelColor(level)}, level);
    }
    text(name, small_, left_ - 0.5 * em_ - advanceOf(name, small_), baselineIn(band, small_), kInk);
    if (frame_.panel.empty()) return;
    // The name of exact leaves is wider than a number.
    const auto widthsOf = [&](int level) { return level == kExactDegree ? 2.0 : 1.0; };
    double widths = 0;
    for (const int level : seen) widths += widthsOf(level);
    double left = frame_.panel.x0 + em_;
    const double unit = std::min((frame_.panel.x1 - em_ - left) / widths, 1.8 * em_);
    for (const int level : seen) {
      const double right = left + widthsOf(level) * unit;
      swatch({left, double(band.y0), right, double(band.y1), levelColor(level)}, level);
      left = right;
    }
  }

  void nameOutside(const PixelRect& row) {
    const std::string name = "outside";
    const double advance = advanceOf(name, small_);
    for (const Piece& piece : line_.pieces) {
      const double left = xOf(piece.tEnter), right = xOf(piece.tLeave);
      if (piece.cell || advance + 0.4 * em_ > right - left) continue;
      text(name, small_, (left + right - advance) / 2, baselineIn(row, small_), kSoftInk);
    }
  }

  // Draws a box in a level's colour, with the level's name if it fits.
  void swatch(const BoxItem& item, int level) {
    layout_.overlay.boxes.push_back(item);
    const std::string name = levelName(level);
    const double advance = advanceOf(name, small_);
    if (advance + 0.4 * em_ > item.x1 - item.x0) return;
    text(name, small_, (item.x0 + item.x1 - advance) / 2, (item.y0 + item.y1 + capHeight(small_)) / 2,
         inkOn(decodeSrgb(levelColor(level))));
  }

  static double baselineIn(const PixelRect& row, double size) { return (row.y0 + row.y1 + capHeight(size)) / 2; }

  double widthOf(const Series& series) const { return (series.broad ? 4.8 : 1.8) * std::max(0.8, em_ / 15); }

  void drawCurves(const PixelRect& chart, const Chart& content, const Scale& scale) {
    const double length = line_.length();
    for (const Series& series : content.series)
      for (const Points& points : series.curves) {
        CurveItem curve{{}, widthOf(series), series.color, chart};
        for (const Eigen::Vector2d& point : points)
          curve.points.emplace_back(xOf(point.x() / length), yOf(chart, scale, point.y()));
        layout_.curves.push_back(std::move(curve));
      }
  }

  // Draws the axis of distances along the line with its title.
  void drawAbscissa() {
    const double length = line_.length();
    const Scale scale{0, length, niceStep(length, std::max(2.0, (right_ - left_) / (6 * em_)))};
    const double baseline = bottom_ + 0.6 * em_ + capHeight(small_);
    const double end = frame_.panel.empty() ? frame_.view.x1 - 2 : frame_.panel.x0 + 0.6 * em_;
    double lastRight = -std::numeric_limits<double>::infinity();
    for (const double tick : ticksOf(scale)) {
      const double x = xOf(tick / length);
      box(x - 0.5 * thin_, bottom_, x + 0.5 * thin_, bottom_ + 0.35 * em_, kTick);
      const std::string label = tickText(tick, scale.step);
      const double left = x - advanceOf(label, small_) / 2, right = left + advanceOf(label, small_);
      if (left < std::max(lastRight + 0.6 * em_, 2.0) || right > end) continue;
      text(label, small_, left, baseline, kInk);
      lastRight = right;
    }
    static const std::string titles[] = {"distance along the line, in the field's units", "distance along the line",
                                         "along the line"};
    const std::string title = fittingTitle(titles, small_, right_ - left_);
    text(title, small_, (left_ + right_ - advanceOf(title, small_)) / 2, baseline + 1.35 * small_, kSoftInk);
  }

  // Draws the legend of a chart: the chart's title and, for each series, a stroke with the name of the series.
  void drawLegend(const PixelRect& chart, const Chart& content) {
    if (frame_.panel.empty()) return;
    const double left = frame_.panel.x0 + em_, right = frame_.panel.x1 - 0.5 * em_;
    double y = chart.y0;
    text(fittingTitle(content.titles, em_, right - left), em_, left, y + capHeight(em_), kInk);
    y += 1.5 * em_;
    for (const Series& series : content.series) {
      if (y + em_ > chart.y1 + 0.7 * em_) return;  // the last row may extend into the gap below
      const double stroke = 1.6 * em_, middle = y + 0.5 * em_, half = widthOf(series) / 2;
      box(left, middle - half, left + stroke, middle + half, series.color);
      text(fittingTitle(series.names, small_, right - left - stroke - 0.5 * em_), small_, left + stroke + 0.5 * em_,
           middle + capHeight(small_) / 2, kInk);
      y += 1.3 * em_;
    }
  }

  void drawCaption() {
    std::size_t cells = 0;
    for (const Piece& piece : line_.pieces) cells += piece.cell.has_value();
    const std::vector<LineJump> jumps = jumpsAlong(line_);
    double greatest = 0;
    for (const LineJump& jump : jumps) greatest = std::max(greatest, std::abs(jump.value));
    // Show as many digits of the coordinates as are needed to tell the two ends of the line apart.
    const double size = std::max(line_.from.cwiseAbs().maxCoeff(), line_.to.cwiseAbs().maxCoeff());
    const int digits = int(std::clamp(std::ceil(std::log10(size / line_.length())) + 3, 4.0, 15.0));
    std::vector<std::string> details = {
        "line " + formatVector(line_.from, digits) + " to " + formatVector(line_.to, digits),
        formatCount(cells) + (cells == 1 ? " cell" : " cells")};
    if (!jumps.empty()) details.push_back("jumps up to " + formatNumber(greatest, 3));
    details.push_back(describeTarget(field_));
    addCaption(layout_.overlay, frame_, describeSource(field_), details);
  }

  const Frame& frame_;
  const Field& field_;
  const Line& line_;
  // Lengths are in pixels.
  const double em_, small_, thin_;  // sizes of normal and small text, width of thin lines
  const bool labelled_;             // true if the picture has room for numbers
  std::vector<Chart> charts_;
  std::vector<Scale> scales_;
  int left_ = 0, right_ = 0;  // x coordinates of the plotted line's ends
  std::vector<PixelRect> bands_;
  int bottom_ = 0;     // lower end of the last chart or band
  LineLayout layout_;  // layout_.charts[n] is the rectangle of charts_[n]
};

CurveItem enlargedCurve(CurveItem curve, const PictureForm& form) {
  for (Eigen::Vector2d& point : curve.points) point *= form.pixelRatio;
  curve.width *= form.pixelRatio;
  for (int* side : {&curve.within.x0, &curve.within.y0, &curve.within.x1, &curve.within.y1})
    *side = enlargedLength(*side, form);
  return curve;
}

/// Returns a curve as a shape of a vector picture. Points that are not finite interrupt it.
VectorLayer curveLayer(const CurveItem& curve, const std::string& name) {
  constexpr double kTolerance = 0.02;  // pixels
  StrokedShape stroke{{{}}, curve.width, curve.color, 1, true};
  for (const Eigen::Vector2d& point : curve.points)
    if (point.allFinite())
      stroke.lines.back().push_back(point);
    else
      stroke.lines.emplace_back();
  for (Polyline& line : stroke.lines) line = simplified(line, kTolerance);
  return {name, {std::move(stroke)}, areaOf(curve.within)};
}

}  // namespace

LineLayout layOutLine(const Frame& frame, const Field& field, const Line& line, std::span<const double> exact) {
  return Plotter(frame, field, line, exact).draw();
}

// Paints a curve. The coverage by all its segments is collected before blending, so that the curve is not
// darker where segments overlap.
void paintCurve(Image& image, const CurveItem& curve) {
  const PixelRect& rect = curve.within;
  if (rect.empty()) return;
  std::vector<float> covered(std::size_t(rect.width()) * rect.height(), 0.0F);
  const double reach = curve.width / 2 + 0.5;
  for (std::size_t i = 1; i < curve.points.size(); ++i) {
    const Eigen::Vector2d &a = curve.points[i - 1], &b = curve.points[i];
    if (!a.allFinite() || !b.allFinite()) continue;
    forEachPixelNear(a, b, reach, rect, [&](const NearPixel& near) {
      float& here = covered[std::size_t(near.y - rect.y0) * rect.width() + (near.x - rect.x0)];
      here = std::max(here, float(std::min(reach - near.distance, 1.0)));
    });
  }
  const LinearColor color = decodeSrgb(curve.color);
  for (int y = rect.y0; y < rect.y1; ++y)
    for (int x = rect.x0; x < rect.x1; ++x)
      if (const float share = covered[std::size_t(y - rect.y0) * rect.width() + (x - rect.x0)]; share > 0)
        mixInto(image.at(x, y), color, share);
}

DrawnLine drawLine(const Field& field, const Line& line, std::span<const double> exact, int width, int height,
                   const PictureForm& form) {
  checkPictureForm(width, height, 1, form);
  LineLayout layout = layOutLine(frame(width, height), field, line, exact);
  layout.overlay = enlarged(std::move(layout.overlay), form.pixelRatio);
  for (CurveItem& curve : layout.curves) curve = enlargedCurve(std::move(curve), form);
  DrawnLine drawn;
  drawn.image = finished(form, [&](const std::optional<Color>& paper) {
    Image image(enlargedLength(width, form), enlargedLength(height, form), paper.value_or(paperColor()));
    paint(image, layout.overlay);
    for (const CurveItem& curve : layout.curves) paintCurve(image, curve);
    return image;
  });
  if (!form.vectors) return drawn;
  std::vector<VectorLayer> layers = {overlayLayer(layout.overlay)};
  for (const CurveItem& curve : layout.curves)
    layers.push_back(curveLayer(curve, "curve-" + std::to_string(layers.size())));
  drawn.vectors = vectorPicture(drawn.image, form, std::move(layers));
  return drawn;
}

}  // namespace hpsdf::render
