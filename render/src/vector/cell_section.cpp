#include "vector/cell_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "vector/paths.h"

namespace hpsdf::render {
namespace {

/// A face of the octree's grid of smallest cells: its axis, and its coordinate in units of these cells. For a face of
/// the box that cells are cut to, 3 is added to the axis.
using GridPlane = std::pair<int, std::int64_t>;

/// The side of a cell's section that lies on a face of the cell.
struct CutSide {
  int from, to;  ///< numbers of points, in the order along the line
  int part;
  bool isHigh;  ///< true if the cell lies at greater coordinates than the face
};

/// Cuts cells by the plane of a view.
class CellCutter {
 public:
  CellCutter(const Field& field, const SliceView& view, int width, int height)
      : view_(view),
        lower_(field.domain().min()),
        cellsPerUnit_(Vector3(field.grid()[0], field.grid()[1], field.grid()[2]).cwiseQuotient(field.domain().sizes()) *
                      std::ldexp(1.0, kMaxDepth)),
        window_(Eigen::Vector2d::Zero(), Eigen::Vector2d(width, height)),
        xOf_(width * view.right / view.right.squaredNorm()),
        yOf_(-height * view.up / view.up.squaredNorm()) {
    // Leaves are half-open. The normal has a positive main component, so that a cell whose lower face lies in the plane
    // is cut, and one whose upper face lies in the plane is not.
    normal_ = view.right.cross(view.up).normalized();
    Eigen::Index axis = 0;
    normal_.cwiseAbs().maxCoeff(&axis);
    if (normal_[axis] < 0) normal_ = -normal_;
    // Cells are cut to a box that is larger than the window, so that coordinates stay in the range of the formats.
    for (const double across : {-0.5, 0.5})
      for (const double upwards : {-0.5, 0.5}) near_.extend(view.origin + across * view.right + upwards * view.up);
    const Vector3 around = Vector3::Constant(std::max(view.right.norm(), view.up.norm()));
    near_ = Box(near_.min() - around, near_.max() + around);
  }

  void cut(const Cell& cell) {
    const Box box = cell.box.intersection(near_);
    if (box.isEmpty()) return;
    const Vector3 low = box.min() - view_.origin, high = box.max() - view_.origin;
    const double middle = normal_.dot(0.5 * (low + high)), reach = normal_.cwiseAbs().dot(0.5 * (high - low));
    if (std::abs(middle) > reach * (1 + 1e-9)) return;
    std::array<Vector3, 8> corners;
    std::array<bool, 8> above;
    for (int k = 0; k < 8; ++k) {
      for (int axis = 0; axis < 3; ++axis) corners[k][axis] = k >> axis & 1 ? high[axis] : low[axis];
      above[k] = normal_.dot(corners[k]) > 0;
    }
    Eigen::AlignedBox2d extent;
    std::vector<std::pair<GridPlane, CutSide>> sides;
    for (int face = 0; face < 6; ++face) {
      const std::vector<Eigen::Vector2d> ends = cutFace(corners, above, face);
      if (ends.size() != 2) continue;
      for (const Eigen::Vector2d& end : ends) extent.extend(end);
      CutSide side{numbers_(ends[0]), numbers_(ends[1]), int(section_.parts.size()), face % 2 == 0};
      if (side.from != side.to) sides.emplace_back(planeOf(face, box, cell), side);
    }
    if (sides.size() < 3 || !extent.intersects(window_)) return;
    section_.parts.push_back({cell, extent});
    for (const auto& [plane, side] : sides) lines_[plane].push_back(side);
  }

  /// Returns the section when all cells have been cut.
  CellSection finish() {
    section_.points = numbers_.points();
    int line = 0;
    for (auto& [plane, sides] : lines_) addEdges(sides, line++);
    return std::move(section_);
  }

 private:
  Eigen::Vector2d inPicture(const Vector3& fromOrigin) const {
    const Eigen::Vector2d middle = 0.5 * window_.max();
    return middle + Eigen::Vector2d(xOf_.dot(fromOrigin), yOf_.dot(fromOrigin));
  }

  /// Returns the plane in which a face of a cell lies, of which `box` is left.
  GridPlane planeOf(int face, const Box& box, const Cell& cell) const {
    const int axis = face / 2;
    const auto coordinateOf = [&](const Box& b) { return (face % 2 ? b.max() : b.min())[axis]; };
    const double coordinate = coordinateOf(box);
    if (coordinate != coordinateOf(cell.box)) return {axis + 3, face % 2};
    return {axis, std::llround((coordinate - lower_[axis]) * cellsPerUnit_[axis])};
  }

  /// Returns the points in which the plane cuts the edges of a face: none or two.
  std::vector<Eigen::Vector2d> cutFace(const std::array<Vector3, 8>& corners, const std::array<bool, 8>& above,
                                       int face) const {
    const int axis = face / 2, across = 1 << (axis + 1) % 3, upwards = 1 << (axis + 2) % 3;
    const int first = face % 2 ? 1 << axis : 0;
    const std::array<int, 5> round = {first, first | across, first | across | upwards, first | upwards, first};
    std::vector<Eigen::Vector2d> ends;
    for (int k = 0; k < 4; ++k) {
      // Corners are taken in ascending order, so that all cells with this edge find the same point.
      const auto [a, b] = std::minmax(round[k], round[k + 1]);
      if (above[a] == above[b]) continue;
      const double from = normal_.dot(corners[a]), to = normal_.dot(corners[b]);
      ends.push_back(inPicture(corners[a] + from / (from - to) * (corners[b] - corners[a])));
    }
    return ends;
  }

  /// Divides the sides that lie on one straight line at all their ends, and adds the edges between the ends.
  void addEdges(std::vector<CutSide>& sides, int line) {
    const Eigen::Vector2d origin = section_.points[std::size_t(sides[0].from)];
    const Eigen::Vector2d along = section_.points[std::size_t(sides[0].to)] - origin;
    const auto place = [&](int point) { return along.dot(section_.points[std::size_t(point)] - origin); };
    std::vector<std::pair<double, int>> stops;
    for (CutSide& side : sides) {
      if (place(side.from) > place(side.to)) std::swap(side.from, side.to);
      for (const int point : {side.from, side.to}) stops.emplace_back(place(point), point);
    }
    std::ranges::sort(stops);
    stops.erase(std::unique(stops.begin(), stops.end()), stops.end());
    const std::size_t first = section_.edges.size();
    for (std::size_t n = 1; n < stops.size(); ++n)
      section_.edges.push_back({stops[n - 1].second, stops[n].second, -1, -1, line});
    for (const CutSide& side : sides)
      for (auto n =
               std::size_t(std::ranges::lower_bound(stops, std::pair(place(side.from), side.from)) - stops.begin());
           stops[n].second != side.to; ++n)
        (side.isHigh ? section_.edges[first + n].high : section_.edges[first + n].low) = side.part;
    const auto gaps = std::remove_if(section_.edges.begin() + std::ptrdiff_t(first), section_.edges.end(),
                                     [](const CellSection::Edge& edge) { return edge.low < 0 && edge.high < 0; });
    section_.edges.erase(gaps, section_.edges.end());
  }

  SliceView view_;
  Vector3 lower_, cellsPerUnit_;
  Eigen::AlignedBox2d window_;
  Box near_;           ///< the part of space to which cells are cut
  Vector3 xOf_, yOf_;  ///< turn a vector from the view's middle to pixels to the right and downwards
  Vector3 normal_;
  PointNumbers numbers_;
  std::map<GridPlane, std::vector<CutSide>> lines_;
  CellSection section_;
};

}  // namespace

CellSection cellSection(const Field& field, const SliceView& view, int width, int height) {
  CellCutter cutter(field, view, width, height);
  field.forEachCell([&](const Cell& cell) { cutter.cut(cell); });
  return cutter.finish();
}

}  // namespace hpsdf::render
