#include "picture/defect_marks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "image/color.h"
#include "image/strokes.h"
#include "view/view_buffers.h"

namespace hpsdf::render {
namespace {

// Light marks have dark casings, dark marks have white ones, so that marks are seen on every ground.
constexpr Color kDarkCasing = {24, 22, 34};
constexpr Color kLightCasing = {255, 255, 255};
constexpr float kMarkCasingStrength = 0.7F;
constexpr float kHiddenMark =
    0.7F;  // opacity of hidden marks; it can be high, because dashes show that the marks are hidden
// The following lengths of a mark's parts are in multiples of the width of a thin line.
constexpr double kDash = 4;  // length of a dash, and of the gap after it
constexpr double kLineWidth = 1.8;
constexpr double kDotRadius = 2.6;
constexpr double kMarkCasingBorder = 0.9;
constexpr double kSmallGroup = 16;     // a group of defects up to this size gets a ring
constexpr double kLeastRing = 9;       // radius of the smallest ring
constexpr double kHiddenBeyond = 4;    // a surface that is nearer by more than this many pixel sizes hides a mark
constexpr double kNearestMark = 1e-3;  // least depth of an edge's drawn part, as a share of the farther end's depth
constexpr int kGroupCell = 8;          // size of a grid cell in pixels; marks in neighbouring cells form one group

/// The names and the colour of a kind of defects, as a row of the legend without a number.
const Swatch& styleOf(DefectKind kind) {
  static const std::array<Swatch, kDefectKinds> styles = {
      {{{"boundary edges", "boundary"}, "", {146, 255, 1}},
       {{"non-manifold edges", "non-manifold", "of 3+ faces"}, "", {3, 38, 108}},
       {{"inconsistent edges", "inconsistent", "opposed"}, "", {13, 108, 95}},
       {{"pinched vertices", "pinched"}, "", {168, 90, 0}},
       {{"pairs of faces that meet", "pairs meet"}, "", {98, 5, 2}}}};
  return styles[static_cast<std::size_t>(kind)];
}

std::string countOf(const MeshDefects& defects, DefectKind kind) {
  const bool all = kind != DefectKind::crossing || defects.allCrossings;
  return (all ? "" : "≥") + formatCount(defects.count(kind));
}

bool isEdge(DefectKind kind) { return kind != DefectKind::pinchedVertex && kind != DefectKind::crossing; }

/// A line, a dot or a ring in the picture. Both ends of a dot or a ring are at its centre.
struct Stroke {
  PicturePoint from, to;
  double radius = 0;     ///< radius of a ring, pixels; 0 for lines and dots
  double halfWidth = 0;  ///< half the width of the line, pixels
  Color color;
  double tolerance = 0;  ///< a surface nearer by more than this hides the stroke, world units
};

class Painter {
 public:
  Painter(Image& picture, const ViewBuffers& buffers, int samples, double lineWidth)
      : picture_(picture), buffers_(buffers), samples_(samples), dash_(kDash * lineWidth) {}

  /// Blends the casings of the strokes, which are wider than these by `border` on every side, over the picture.
  void paintCasings(const std::vector<Stroke>& strokes, double border) {
    for (const Stroke& stroke : strokes) {
      const bool isLight = toOklab(decodeSrgb(stroke.color)).lightness > 0.6;
      paint(stroke, border, decodeSrgb(isLight ? kDarkCasing : kLightCasing), kMarkCasingStrength);
    }
  }

  void paintCores(const std::vector<Stroke>& strokes) {
    for (const Stroke& stroke : strokes) paint(stroke, 0, decodeSrgb(stroke.color), 1);
  }

 private:
  void paint(const Stroke& stroke, double border, const LinearColor& color, float opacity) {
    const Eigen::Vector2d from(stroke.from.x, stroke.from.y), to(stroke.to.x, stroke.to.y);
    const double reach = stroke.halfWidth + border + 0.5;  // distance covered around the segment or ring, pixels
    const PixelRect view{0, 0, buffers_.width / samples_, buffers_.height / samples_};
    forEachPixelNear(from, to, stroke.radius + reach, view, [&](const NearPixel& near) {
      const double covered = std::min(reach - std::abs(near.distance - stroke.radius), 1.0);
      if (covered <= 0) return;
      const bool hidden = isHidden(stroke, near.t, near.x, near.y);
      if (hidden && isGap(stroke, near.middle)) return;
      const float strength = hidden ? kHiddenMark : 1.0F;
      mixInto(picture_.at(near.x, near.y), color, opacity * strength * static_cast<float>(covered));
    });
  }

  /// Returns true if the buffers show something in front of a stroke at pixel (x, y). A ring is hidden as a whole
  /// if its centre is hidden.
  bool isHidden(const Stroke& stroke, double t, int x, int y) const {
    if (stroke.radius > 0) x = int(stroke.from.x), y = int(stroke.from.y);
    if (x < 0 || y < 0 || x >= buffers_.width / samples_ || y >= buffers_.height / samples_) return false;
    // In perspective the reciprocal of the distance is linear along the line in the picture.
    const double distance = 1 / ((1 - t) / stroke.from.distance + t / stroke.to.distance);
    return hides(buffers_, samples_, x, y, distance, stroke.tolerance);
  }

  /// Returns true in the gaps of a dashed stroke. Gaps depend on the position in the picture rather than on the
  /// position along the line, so that edges shorter than a dash have gaps too. A dot has no gaps.
  bool isGap(const Stroke& stroke, const Eigen::Vector2d& position) const {
    const double across = std::abs(stroke.to.x - stroke.from.x), down = std::abs(stroke.to.y - stroke.from.y);
    double path = across > down ? position.x() : position.y();
    if (stroke.radius > 0)
      path =
          stroke.radius * (std::numbers::pi + std::atan2(position.y() - stroke.from.y, position.x() - stroke.from.x));
    else if (across == 0 && down == 0)
      return false;
    return std::fmod(path, 2 * dash_) >= dash_;
  }

  Image& picture_;
  const ViewBuffers& buffers_;
  int samples_;
  double dash_;  ///< length of a dash, pixels
};

/// Groups of defects of one kind. The picture is divided into square cells (kGroupCell), and a group is a connected
/// component of the cells that contain defects.
class Groups {
 public:
  Groups(int width, int height)
      : columns_(width / kGroupCell + 1), rows_(height / kGroupCell + 1), cells_(std::size_t(columns_) * rows_) {}

  struct Group {
    Eigen::AlignedBox2d extent;
    PicturePoint nearest = {};
  };

  /// Returns all groups and empties the cells.
  std::vector<Group> extract() {
    std::vector<Group> groups;
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column)
        if (!at(column, row).extent.isEmpty()) groups.push_back(extractFrom(column, row));
    return groups;
  }

  /// Adds points along a line to the groups, about one for each cell on the line.
  void add(const PicturePoint& from, const PicturePoint& to) {
    const double length = std::hypot(to.x - from.x, to.y - from.y);
    const int steps = int(std::min(std::ceil(length / kGroupCell), 1e4));
    add(from);
    for (int i = 1; i <= steps; ++i) {
      const double t = double(i) / steps;
      const auto between = [t](double a, double b) { return a + t * (b - a); };
      add({between(from.x, to.x), between(from.y, to.y), between(from.depth, to.depth),
           between(from.distance, to.distance)});
    }
  }

 private:
  void add(const PicturePoint& p) {
    if (!(p.x >= 0 && p.y >= 0 && p.x < columns_ * kGroupCell && p.y < rows_ * kGroupCell)) return;
    Group& cell = at(int(p.x) / kGroupCell, int(p.y) / kGroupCell);
    if (cell.extent.isEmpty() || p.distance < cell.nearest.distance) cell.nearest = p;
    cell.extent.extend(Eigen::Vector2d(p.x, p.y));
  }

  Group extractFrom(int column, int row) {
    Group group{.extent = {}, .nearest = at(column, row).nearest};
    std::vector<std::array<int, 2>> pending = {{column, row}};
    while (!pending.empty()) {
      const auto [x, y] = pending.back();
      pending.pop_back();
      Group& cell = at(x, y);
      if (cell.extent.isEmpty()) continue;
      group.extent.extend(cell.extent);
      cell.extent.setEmpty();
      if (cell.nearest.distance < group.nearest.distance) group.nearest = cell.nearest;
      for (int v = std::max(0, y - 1); v <= std::min(rows_ - 1, y + 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(columns_ - 1, x + 1); ++u) pending.push_back({u, v});
    }
    return group;
  }

  Group& at(int column, int row) { return cells_[std::size_t(row) * columns_ + column]; }

  int columns_, rows_;
  std::vector<Group> cells_;  ///< the defects in each cell of the picture; the extent is empty if there are none
};

/// The end points, in the picture, of the part of a segment that lies in front of the eye. If there is no such part,
/// both returned points are behind the eye.
std::array<PicturePoint, 2> beforeEye(const Camera& camera, const std::array<Vector3, 2>& ends, int width, int height) {
  const auto seen = [&](const Vector3& point) { return project(camera, point, width, height); };
  PicturePoint from = seen(ends[0]), to = seen(ends[1]);
  const double nearest = kNearestMark * std::max(from.depth, to.depth);
  if (!(nearest > 0)) return {from, from};
  const auto share = [&](double depth, double other) { return (nearest - depth) / (other - depth); };
  const Vector3 along = ends[1] - ends[0];
  if (from.depth < nearest) return {seen(ends[0] + share(from.depth, to.depth) * along), to};
  if (to.depth < nearest) return {from, seen(ends[1] - share(to.depth, from.depth) * along)};
  return {from, to};
}

}  // namespace

Color defectColor(DefectKind kind) { return styleOf(kind).color; }

std::vector<Legend::Defects> defectLegend(const MeshDefects& defects) {
  std::vector<Legend::Defects> legend;
  for (const Swatch& swatch : defectSwatches(defects))
    legend.push_back({swatch.names.front(), swatch.count, swatch.color});
  return legend;
}

std::vector<Swatch> defectSwatches(const MeshDefects& defects) {
  std::vector<Swatch> swatches;
  for (std::size_t i = 0; i < kDefectKinds; ++i) {
    const auto kind = DefectKind(i);
    if (defects.count(kind) == 0) continue;
    swatches.push_back(styleOf(kind));
    swatches.back().count = countOf(defects, kind);
  }
  return swatches;
}

void paintDefects(Image& picture, const Camera& camera, const ViewBuffers& buffers, int samples,
                  const MeshDefects& defects, double lineWidth) {
  const int width = buffers.width / samples, height = buffers.height / samples;
  const double halfWidth = 0.5 * kLineWidth * lineWidth;
  const auto toleranceAt = [&](double depth) { return kHiddenBeyond * pixelSize(camera, depth, height); };
  std::vector<Stroke> strokes;
  for (std::size_t kind = 0; kind < kDefectKinds; ++kind) {
    // Collect the lines and dots for the defects of one kind, and group the defects.
    Groups groups(width, height);
    const Color color = defectColor(DefectKind(kind));
    for (const Defect& defect : defects.ofKind(DefectKind(kind))) {
      const auto [from, to] = beforeEye(camera, defect.ends, width, height);
      if (!(from.depth > 0)) continue;
      const double tolerance = toleranceAt(std::max(from.depth, to.depth));
      groups.add(from, to);
      if (isEdge(defect.kind))
        strokes.push_back({from, to, 0, halfWidth, color, tolerance});
      else if (defect.kind == DefectKind::pinchedVertex)
        strokes.push_back({from, to, 0, kDotRadius * lineWidth, color, tolerance});
    }

    // Put a ring around each small group of defects.
    for (const Groups::Group& group : groups.extract()) {
      const double size = group.extent.sizes().maxCoeff();
      if (size > kSmallGroup * lineWidth) continue;
      PicturePoint middle = group.nearest;
      middle.x = group.extent.center().x();
      middle.y = group.extent.center().y();
      strokes.push_back(
          {middle, middle, kLeastRing * lineWidth + 0.5 * size, halfWidth, color, toleranceAt(middle.depth)});
    }
  }

  // Paint the casings of all marks before their cores, so that no casing covers the core of a neighbour.
  Painter painter(picture, buffers, samples, lineWidth);
  painter.paintCasings(strokes, kMarkCasingBorder * lineWidth);
  painter.paintCores(strokes);
}

}  // namespace hpsdf::render
