#include "hpsdf/detail/line.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include "field/query/blend.h"
#include "field/query/evaluate.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

/// The shortest piece of a segment, as a fraction of the segment's length. Shorter pieces result from rounding errors.
constexpr double kShortest = 1e-12;

/// One coordinate of the points of a segment, as a linear function of the parameter t from 0 to 1. The unit is the edge
/// of a cell of the greatest depth, so that faces of cells lie at integers. Even with rounding, a face gets the same t
/// from all leaves that touch it, and a face farther along the segment never gets a smaller t.
struct Axis {
  double start = 0, speed = 0;  ///< coordinate at t = 0 and its change over the whole segment
  std::int64_t cells = 0;

  double coordinate(double t) const { return start + t * speed; }
  double tAtFace(std::int64_t face) const { return (static_cast<double>(face) - start) / speed; }
};
using Axes = std::array<Axis, 3>;

std::int64_t clampedCell(double coordinate, std::int64_t first, std::int64_t last) {
  return static_cast<std::int64_t>(
      std::clamp(std::floor(coordinate), static_cast<double>(first), static_cast<double>(last)));
}

Axes segmentAxes(const GridFrame& frame, const Vector3& from, const Vector3& to) {
  constexpr auto kOne = static_cast<double>(query::kFixedPointOne);
  Axes axes;
  for (int a = 0; a < 3; ++a) {
    axes[a].start = query::gridCoordinate(frame, a, from[a]) * kOne;
    axes[a].speed = query::gridCoordinate(frame, a, to[a]) * kOne - axes[a].start;
    axes[a].cells = frame.last[a] + 1;
    if (!std::isfinite(axes[a].start) || !std::isfinite(axes[a].speed))
      throw Error("a segment's ends must be finite, and not too far from the field: give other points");
  }
  return axes;
}

/// A range of the parameter t along a segment.
struct Span {
  double first, last;
};

/// Returns the part of the segment within the domain, or std::nullopt if the segment misses the domain.
std::optional<Span> clipToDomain(const Axes& axes) {
  Span span{0, 1};
  for (const Axis& axis : axes) {
    if (axis.speed == 0) {
      if (axis.start < 0 || axis.start > static_cast<double>(axis.cells)) return {};
      continue;
    }
    const auto [enter, leave] = std::minmax({axis.tAtFace(0), axis.tAtFace(axis.cells)});
    span = {std::max(span.first, enter), std::min(span.last, leave)};
  }
  if (!(span.last - span.first > kShortest)) return {};
  return span;
}

/// Returns the width of the leaf that holds a cell of the greatest depth, measured in cells of that depth.
std::int64_t leafWidth(const Field& field, const query::CellIndex& cell) {
  query::GridPoint point{{}, cell, 0};
  for (int a = 0; a < 3; ++a) point.path |= query::pathBits(a, cell[a]);
  return std::int64_t{1} << (kMaxDepth - query::findLeafNode(field.data(), point).depth);
}

Vector3 centerOf(const GridFrame& frame, const query::CellIndex& corner, std::int64_t width) {
  std::array<double, 3> center;
  for (int a = 0; a < 3; ++a)
    center[a] = std::ldexp(static_cast<double>(corner[a]) + 0.5 * static_cast<double>(width), -kMaxDepth);
  return query::worldPoint(frame, center);
}

/// Returns the parameter t at which the segment leaves a leaf along one axis, or infinity if the coordinate on
/// this axis is constant.
double tAtExit(const Axis& axis, std::int64_t corner, std::int64_t width) {
  if (axis.speed > 0) return axis.tAtFace(corner + width);
  return axis.speed < 0 ? axis.tAtFace(corner) : std::numeric_limits<double>::infinity();
}

/// Divides a segment into one piece for each leaf, in the order along the segment. Despite rounding, each step
/// advances along at least one axis and goes back along none, so that the loop ends and visits no leaf twice.
/// Cell indices refer to the greatest depth.
std::vector<Piece> walk(const Field& field, const GridFrame& frame, const Axes& axes, const Span& span) {
  std::vector<Piece> pieces;
  query::CellIndex cell, corner;
  for (int a = 0; a < 3; ++a) cell[a] = clampedCell(axes[a].coordinate(span.first), 0, frame.last[a]);
  for (double t = span.first;;) {
    // Find the parameter t at which the segment leaves the leaf, and append the piece up to it.
    const std::int64_t width = leafWidth(field, cell);
    std::array<double, 3> exit;
    for (int a = 0; a < 3; ++a) {
      corner[a] = cell[a] & ~(width - 1);
      exit[a] = tAtExit(axes[a], corner[a], width);
    }
    const double next = *std::ranges::min_element(exit);
    if (const double end = std::min(next, span.last); end - t > kShortest) {
      pieces.push_back({field.cellAt(centerOf(frame, corner, width)), t, end});
      t = end;
    }
    if (next >= span.last) return pieces;

    // Move to the next leaf, across every face that the segment meets at its exit from the leaf.
    for (int a = 0; a < 3; ++a) {
      if (exit[a] == next)
        cell[a] = axes[a].speed > 0 ? corner[a] + width : corner[a] - 1;
      else
        cell[a] = clampedCell(axes[a].coordinate(next), corner[a], corner[a] + width - 1);
      if (cell[a] < 0 || cell[a] > frame.last[a]) return pieces;
    }
  }
}

Vector3 pointAt(const Vector3& from, const Vector3& to, double t) {
  return {std::lerp(from.x(), to.x(), t), std::lerp(from.y(), to.y(), t), std::lerp(from.z(), to.z(), t)};
}

/// Evaluates the field at a point x of a leaf. On the leaf's faces, the result is the limit from within the
/// leaf. Without blending, the result is the leaf's polynomial, for any x.
ValueAndGradient valueAndGradientIn(const Field& field, const Cell& cell, const Vector3& x) {
  const GridFrame& frame = field.lookupGrid().frame;
  std::array<double, 3> coordinates;
  query::CellIndex cellIndex;
  for (int axis = 0; axis < 3; ++axis) {
    coordinates[axis] = query::gridCoordinate(frame, axis, x[axis]);
    cellIndex[axis] = std::llround(std::ldexp(query::gridCoordinate(frame, axis, cell.box.min()[axis]), cell.depth));
  }
  const query::LeafPoint leaf =
      query::leafPoint(field.data().nodes[cell.id], cell.depth, cell.id, cellIndex, coordinates);
  return query::evaluateInLeaf<ValueAndGradient>(field.data(), field.lookupGrid(), coordinates, leaf);
}

/// Evaluates the continuation of the field outside the domain. The gradient is taken slightly inside the piece of
/// the segment, because on the domain's boundary the gradient of the boundary leaf differs from the gradient of
/// the continuation.
ValueAndGradient evaluateOutside(const Field& field, const Line& line, const Piece& piece, double t) {
  constexpr double kMargin = 1e-9;
  const double margin = kMargin * (piece.tLeave - piece.tEnter);
  const double inside = std::clamp(t, piece.tEnter + margin, piece.tLeave - margin);
  return {field.value(pointAt(line.from, line.to, t)),
          field.valueAndGradient(pointAt(line.from, line.to, inside)).gradient};
}

}  // namespace

std::vector<Piece> piecesAlong(const Field& field, const Vector3& from, const Vector3& to) {
  if (from == to) throw Error("a segment's ends are one and the same point: give two");
  const GridFrame& frame = field.lookupGrid().frame;
  const Axes axes = segmentAxes(frame, from, to);
  const std::optional<Span> span = clipToDomain(axes);
  std::vector<Piece> pieces;
  if (span) pieces = walk(field, frame, axes, *span);
  if (pieces.empty()) return {{std::nullopt, 0, 1}};

  pieces.back().tLeave = span->last;
  if (span->first > kShortest)
    pieces.insert(pieces.begin(), {std::nullopt, 0, span->first});
  else
    pieces.front().tEnter = 0;
  if (1 - span->last > kShortest)
    pieces.push_back({std::nullopt, span->last, 1});
  else
    pieces.back().tLeave = 1;
  return pieces;
}

Line sampleLine(const Field& field, const Vector3& from, const Vector3& to, int count) {
  assert(count >= 2);
  Line line{from, to, piecesAlong(field, from, to), {}};
  line.samples.reserve(static_cast<std::size_t>(count) + 2 * line.pieces.size());
  int next = 0;  // number of the next evenly spaced sample
  const auto nextT = [&] { return static_cast<double>(next) / (count - 1); };
  for (std::size_t n = 0; n < line.pieces.size(); ++n) {
    const Piece& piece = line.pieces[n];
    const auto add = [&](double t) {
      const Vector3 x = pointAt(from, to, t);
      const auto [value, gradient] =
          piece.cell ? valueAndGradientIn(field, *piece.cell, x) : evaluateOutside(field, line, piece, t);
      line.samples.push_back({t, n, x, value, gradient});
    };
    add(piece.tEnter);
    while (next < count && nextT() <= piece.tEnter) ++next;
    for (; next < count && nextT() < piece.tLeave; ++next) add(nextT());
    add(piece.tLeave);
  }
  return line;
}

std::vector<LineJump> jumpsAlong(const Line& line) {
  std::vector<LineJump> jumps;
  for (std::size_t i = 1; i < line.samples.size(); ++i) {
    const LineSample &before = line.samples[i - 1], &after = line.samples[i];
    if (before.piece != after.piece && line.pieces[before.piece].cell && line.pieces[after.piece].cell)
      jumps.push_back({after.t, after.value - before.value});
  }
  return jumps;
}

}  // namespace hpsdf
