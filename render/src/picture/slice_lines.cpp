#include "picture/slice_lines.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "coloring/color_view.h"
#include "coloring/line_style.h"
#include "image/color.h"
#include "image/strokes.h"
#include "picture/cracks.h"
#include "vector/paths.h"

namespace hpsdf::render {
namespace {

constexpr int kOutlineBlock = 8;  // pixels along each side of a block in which an outline is searched
// Vector pictures are mixed in sRGB values instead of linear light: there, this opacity has the effect of the strength
// on most colours.
constexpr double kOutlineCasingOpacity = 0.6;
// The following lengths are in multiples of the width of a thin line.
constexpr double kOutlineWidth = 2.6;
constexpr double kOutlineCasingBorder = 1.3;
constexpr double kMeshLineWidth = 1.4;
constexpr double kMeshDotRadius = 2.2;   // of the dots where the section of a mesh bends
constexpr double kDottedLength = 14;     // lines of this length or more have dots at their ends
constexpr double kOutlineDash = 8;       // length of a dash, and of the gap after it
constexpr double kLegendTitle = 2.7;     // height of the legend's title and of the gap below the rows, in ems
constexpr double kLineTolerance = 0.02;  // pixels by which a line of a vector picture may differ
constexpr double kOnSurface = 2;         // pixels between an outline and the field's surface up to which they agree

/// The point at a position in a view, in pixels from its upper left corner; the middle of the first pixel is (½, ½).
Vector3 pointIn(const SliceView& view, const Eigen::Vector2d& at, int width, int height) {
  return view.origin + view.right * (at.x() / width - 0.5) + view.up * (0.5 - at.y() / height);
}

/// The distances at the middles of neighbouring pixels. The first of them is the pixel (x0, y0).
struct DistanceGrid {
  int x0, y0, columns, rows;
  std::vector<double> values = {};

  double at(int x, int y) const { return values[std::size_t(y) * columns + x]; }
};

DistanceGrid distancesOf(const DistanceFunction& distance, const SliceView& view, DistanceGrid grid, int step,
                         int width, int height) {
  std::vector<Vector3> points;
  for (int y = 0; y < grid.rows; ++y)
    for (int x = 0; x < grid.columns; ++x)
      points.push_back(pointIn(view, {grid.x0 + x * step + 0.5, grid.y0 + y * step + 0.5}, width, height));
  grid.values.resize(points.size());
  distance(points, grid.values);
  return grid;
}

/// Adds the lines between the crossings on the edges of the square between four pixels, of which (x, y) is the first.
void addCrossings(const DistanceGrid& grid, int x, int y, std::vector<FlatLine>& lines) {
  constexpr std::array<std::array<int, 2>, 5> kCorners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}}};
  std::vector<Eigen::Vector2d> crossings;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto [ax, ay] = kCorners[k];
    const auto [bx, by] = kCorners[k + 1];
    const double a = grid.at(x + ax, y + ay), b = grid.at(x + bx, y + by);
    if ((a < 0) == (b < 0)) continue;
    const double t = a / (a - b);
    crossings.emplace_back(grid.x0 + x + 0.5 + ax + t * (bx - ax), grid.y0 + y + 0.5 + ay + t * (by - ay));
  }
  for (std::size_t n = 1; n < crossings.size(); n += 2) lines.push_back({crossings[n - 1], crossings[n]});
}

/// For each pixel of a picture, the distance to the nearest of the lines that were added, as far as it is at most
/// `reach`. Lines may overlap; a pixel is painted once.
class LineDistances {
 public:
  LineDistances(const PixelRect& part, double reach)
      : part_(part),
        reach_(reach),
        nearest_(std::size_t(part.width()) * std::size_t(part.height()), std::numeric_limits<double>::infinity()) {}

  /// Adds a line that is wider than others by `wider` on each side.
  void add(const FlatLine& line, double wider = 0) {
    forEachPixelNear(line.from, line.to, reach_ + wider, part_, [&](const NearPixel& near) {
      double& nearest = nearest_[index(near.x, near.y)];
      nearest = std::min(nearest, near.distance - wider);
    });
  }

  /// Paints the pixels that lines of this half width cover.
  void paint(Image& picture, Color color, double halfWidth, float strength) const {
    const LinearColor linear = decodeSrgb(color);
    for (int y = part_.y0; y < part_.y1; ++y)
      for (int x = part_.x0; x < part_.x1; ++x) {
        const double covered = std::min(halfWidth + 0.5 - nearest_[index(x, y)], 1.0);
        if (covered > 0) mixInto(picture.at(x, y), linear, strength * static_cast<float>(covered));
      }
  }

 private:
  std::size_t index(int x, int y) const {
    return std::size_t(y - part_.y0) * std::size_t(part_.width()) + std::size_t(x - part_.x0);
  }

  PixelRect part_;
  double reach_;
  std::vector<double> nearest_;
};

/// Returns true in the gaps of a dashed line. Gaps depend on the position in the picture, because outlines consist of
/// lines that are shorter than a dash.
bool isGap(const FlatLine& line, double dash) {
  const Eigen::Vector2d along = line.to - line.from, middle = 0.5 * (line.from + line.to);
  const double path = std::abs(along.x()) > std::abs(along.y()) ? middle.x() : middle.y();
  return std::fmod(path, 2 * dash) >= dash;
}

/// Tells for each line whether the field's surface is at most `kOnSurface` pixels away from it.
std::vector<bool> areOnSurface(const std::vector<FlatLine>& lines, const Field& field, const SliceView& view, int width,
                               int height) {
  std::vector<Vector3> points;
  for (const FlatLine& line : lines) points.push_back(pointIn(view, 0.5 * (line.from + line.to), width, height));
  std::vector<double> values(points.size());
  field.values(points, values);
  const double most = kOnSurface * view.right.norm() / width;
  std::vector<bool> result;
  for (const double value : values) result.push_back(std::abs(value) <= most);
  return result;
}

/// Returns the outline of a solid without the gaps where it does not follow the field's surface.
std::vector<FlatLine> dashedOutline(const DistanceFunction& distance, const Field& field, const SliceView& view,
                                    const PixelRect& part, int width, int height, double lineWidth) {
  const std::vector<FlatLine> lines = outlineOf(distance, view, part, width, height);
  const std::vector<bool> onSurface = areOnSurface(lines, field, view, width, height);
  std::vector<FlatLine> drawn;
  for (std::size_t n = 0; n < lines.size(); ++n)
    if (onSurface[n] || !isGap(lines[n], kOutlineDash * lineWidth)) drawn.push_back(lines[n]);
  return drawn;
}

/// Joins lines that meet at their ends.
std::vector<Polyline> joinedLines(const std::vector<FlatLine>& lines) {
  PointNumbers numbers;
  std::vector<Link> links;
  for (const FlatLine& line : lines)
    if (const Link link = {numbers(line.from), numbers(line.to)}; link[0] != link[1]) links.push_back(link);
  std::vector<Polyline> joined = joinedLinks(links, numbers.points());
  for (Polyline& line : joined) line = simplified(line, kLineTolerance);
  return joined;
}

void paintMesh(Image& picture, const std::vector<FlatLine>& lines, const PixelRect& part, double lineWidth) {
  const double halfWidth = 0.5 * kMeshLineWidth * lineWidth;
  LineDistances distances(part, halfWidth + 0.5);
  for (const FlatLine& line : lines) {
    distances.add(line);
    if ((line.to - line.from).norm() < kDottedLength * lineWidth) continue;
    for (const Eigen::Vector2d& end : {line.from, line.to})
      distances.add({end, end}, kMeshDotRadius * lineWidth - halfWidth);
  }
  distances.paint(picture, kCrackColor, halfWidth, 1);
}

}  // namespace

std::vector<FlatLine> outlineOf(const DistanceFunction& distance, const SliceView& view, const PixelRect& part,
                                int width, int height) {
  // The surface can meet only blocks whose middle is closer to it than their corners are to the middle.
  const double pixel = std::max(view.right.norm() / width, view.up.norm() / height);
  const double reach = std::sqrt(2.0) * (kOutlineBlock / 2 + 1) * pixel;
  const int columns = (part.width() + kOutlineBlock - 1) / kOutlineBlock,
            rows = (part.height() + kOutlineBlock - 1) / kOutlineBlock;
  std::vector<std::vector<FlatLine>> ofRows(std::size_t(std::max(rows, 0)));
  tbb::parallel_for(0, rows, [&](int row) {
    const int top = part.y0 + row * kOutlineBlock;
    const DistanceGrid middles =
        distancesOf(distance, view, {part.x0 + kOutlineBlock / 2, top + kOutlineBlock / 2, columns, 1}, kOutlineBlock,
                    width, height);
    for (int column = 0; column < columns; ++column) {
      if (!(std::abs(middles.at(column, 0)) <= reach)) continue;
      const int left = part.x0 + column * kOutlineBlock;
      const DistanceGrid grid = distancesOf(
          distance, view,
          {left, top, std::min(kOutlineBlock + 1, part.x1 - left), std::min(kOutlineBlock + 1, part.y1 - top)}, 1,
          width, height);
      for (int y = 0; y + 1 < grid.rows; ++y)
        for (int x = 0; x + 1 < grid.columns; ++x) addCrossings(grid, x, y, ofRows[std::size_t(row)]);
    }
  });
  std::vector<FlatLine> lines;
  for (const std::vector<FlatLine>& ofRow : ofRows) lines.insert(lines.end(), ofRow.begin(), ofRow.end());
  return lines;
}

std::vector<FlatLine> sectionOf(const TriangleMesh& mesh, const SliceView& view, int width, int height) {
  const Vector3 normal = view.right.cross(view.up).normalized();
  std::vector<double> heights;
  for (const Vector3& vertex : mesh.vertices) heights.push_back(normal.dot(vertex - view.origin));
  const auto inPicture = [&](const Vector3& point) {
    const Vector3 at = point - view.origin;
    return Eigen::Vector2d((at.dot(view.right) / view.right.squaredNorm() + 0.5) * width,
                           (0.5 - at.dot(view.up) / view.up.squaredNorm()) * height);
  };
  std::vector<FlatLine> lines;
  for (const Triangle& triangle : mesh.triangles) {
    std::vector<Eigen::Vector2d> ends;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
      if ((heights[a] < 0) == (heights[b] < 0)) continue;
      const double t = heights[a] / (heights[a] - heights[b]);
      ends.push_back(inPicture(mesh.vertices[a] + t * (mesh.vertices[b] - mesh.vertices[a])));
    }
    if (ends.size() == 2) lines.push_back({ends[0], ends[1]});
  }
  return lines;
}

std::span<const Color> outlineColors() {
  static constexpr std::array<Color, 5> kColors = {
      {{249, 212, 3}, {70, 104, 141}, {110, 104, 97}, {1, 49, 43}, {149, 159, 160}}};
  return kColors;
}

Color outlineColor(std::size_t index) { return outlineColors()[index % outlineColors().size()]; }

std::vector<Legend::Line> lineLegend(const ReferenceData& reference) {
  std::vector<Legend::Line> lines;
  for (const OutlinedSolid& solid : reference.outlined) lines.push_back({solid.name, outlineColor(lines.size())});
  if (reference.mesh.mesh != nullptr) lines.push_back({"triangles", kCrackColor});
  return lines;
}

void addLineLegend(Overlay& overlay, Frame& frame, const std::vector<Legend::Line>& lines) {
  static const std::array<std::string, 1> kTitles = {"outlines"};
  if (lines.empty() || frame.panel.empty()) return;
  // The rows take at most half of the panel; the last one tells how many others there are. A low panel has none.
  const double room = 0.5 * frame.panel.height() - kLegendTitle * frame.textSize;
  if (room < swatchHeight(frame)) return;
  const auto most = static_cast<std::size_t>(room / swatchHeight(frame));
  std::vector<Swatch> swatches;
  for (const auto& [name, color] : lines) swatches.push_back({{name}, "", color});
  if (swatches.size() > most) {
    swatches.resize(most);
    swatches.back() = {{"and " + formatCount(lines.size() - most + 1) + " more"}, "", paperColor()};
  }
  addSwatches(overlay, frame, kTitles, swatches);
  frame.panel.y0 += static_cast<int>(kLegendTitle * frame.textSize + double(swatches.size()) * swatchHeight(frame));
}

void paintSliceLines(Image& picture, const Field& field, const SliceView& view, const PixelRect& part, int width,
                     int height, const ReferenceData& reference, double lineWidth) {
  if (part.empty()) return;  // the view shows nothing of the domain
  const double halfWidth = 0.5 * kOutlineWidth * lineWidth, border = kOutlineCasingBorder * lineWidth;
  for (std::size_t n = 0; n < reference.outlined.size(); ++n) {
    LineDistances distances(part, halfWidth + border + 0.5);
    for (const FlatLine& line :
         dashedOutline(*reference.outlined[n].distance, field, view, part, width, height, lineWidth))
      distances.add(line);
    distances.paint(picture, kLineCasing, halfWidth + border, float(kLineCasingStrength));
    distances.paint(picture, outlineColor(n), halfWidth, 1);
  }
  if (reference.mesh.mesh != nullptr)
    paintMesh(picture, sectionOf(*reference.mesh.mesh, view, width, height), part, lineWidth);
}

std::vector<VectorShape> sliceLineShapes(const Field& field, const SliceView& view, const PixelRect& part, int width,
                                         int height, const ReferenceData& reference, double lineWidth) {
  std::vector<VectorShape> shapes;
  if (part.empty()) return shapes;  // the view shows nothing of the domain
  for (std::size_t n = 0; n < reference.outlined.size(); ++n) {
    StrokedShape line{
        joinedLines(dashedOutline(*reference.outlined[n].distance, field, view, part, width, height, lineWidth)),
        kOutlineWidth * lineWidth, outlineColor(n), 1, true};
    StrokedShape casing = line;
    casing.width += 2 * kOutlineCasingBorder * lineWidth;
    casing.color = kLineCasing;
    casing.opacity = kOutlineCasingOpacity;
    shapes.emplace_back(std::move(casing));
    shapes.emplace_back(std::move(line));
  }
  if (reference.mesh.mesh == nullptr) return shapes;
  StrokedShape mesh{{}, kMeshLineWidth * lineWidth, kCrackColor, 1, true};
  StrokedShape dots{{}, 2 * kMeshDotRadius * lineWidth, kCrackColor, 1, true};
  for (const FlatLine& line : sectionOf(*reference.mesh.mesh, view, width, height)) {
    mesh.lines.push_back({line.from, line.to});
    if ((line.to - line.from).norm() < kDottedLength * lineWidth) continue;
    dots.lines.push_back({line.from});
    dots.lines.push_back({line.to});
  }
  shapes.emplace_back(std::move(mesh));
  shapes.emplace_back(std::move(dots));
  return shapes;
}

}  // namespace hpsdf::render
