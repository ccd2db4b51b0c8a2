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

constexpr double kShortest = 1e-12;  // of a segment: what is shorter is rounding

/// A coordinate along the segment, in cells of the greatest depth, whose faces are the whole numbers. Every leaf at a
/// face takes the same `when` for it, and faces farther on never come earlier.
struct Axis {
  double start = 0, speed = 0;
  std::int64_t cells = 0;

  double at(double t) const { return start + t * speed; }
  double when(std::int64_t face) const { return (static_cast<double>(face) - start) / speed; }
};
using Axes = std::array<Axis, 3>;
using Place = std::array<std::int64_t, 3>;

std::int64_t cellWithin(double coordinate, std::int64_t first, std::int64_t last) {
  return static_cast<std::int64_t>(
      std::clamp(std::floor(coordinate), static_cast<double>(first), static_cast<double>(last)));
}

double gridCoordinate(const GridFrame& frame, int axis, double x) {
  return ((x - frame.lower[axis]) / frame.size[axis]) * frame.cells[axis];
}

Axes axesOf(const GridFrame& frame, const Vector3& from, const Vector3& to) {
  constexpr auto kOne = static_cast<double>(std::int64_t{1} << kMaxDepth);
  Axes axes;
  for (int a = 0; a < 3; ++a) {
    axes[a].start = gridCoordinate(frame, a, from[a]) * kOne;
    axes[a].speed = gridCoordinate(frame, a, to[a]) * kOne - axes[a].start;
    axes[a].cells = frame.last[a] + 1;
    if (!std::isfinite(axes[a].start) || !std::isfinite(axes[a].speed))
      throw Error("a segment's ends must be finite, and not too far from the field: give other points");
  }
  return axes;
}

struct Span {
  double first, last;
};

/// The part within the domain, if there is any.
std::optional<Span> spanWithin(const Axes& axes) {
  Span span{0, 1};
  for (const Axis& axis : axes) {
    if (axis.speed == 0) {
      if (axis.start < 0 || axis.start > static_cast<double>(axis.cells)) return {};
      continue;
    }
    const auto [enter, leave] = std::minmax({axis.when(0), axis.when(axis.cells)});
    span = {std::max(span.first, enter), std::min(span.last, leave)};
  }
  if (!(span.last - span.first > kShortest)) return {};
  return span;
}

/// As `gridPoint` makes it of a point.
GridPoint pointIn(const Place& place) {
  GridPoint point{};
  point.fixed = place;
  for (int a = 0; a < 3; ++a) point.path |= pathAlong(a, place[a]);
  return point;
}

Vector3 centerOf(const GridFrame& frame, const Place& corner, std::int64_t width) {
  std::array<double, 3> center;
  for (int a = 0; a < 3; ++a)
    center[a] = std::ldexp(static_cast<double>(corner[a]) + 0.5 * static_cast<double>(width), -kMaxDepth);
  return worldPoint(frame, center);
}

/// From leaf to leaf. Each step goes on along one axis at least and along none back, whatever is rounded: so it ends,
/// and no leaf comes twice.
std::vector<Piece> walk(const Field& field, const GridFrame& frame, const Axes& axes, const Span& span) {
  std::vector<Piece> pieces;
  Place place, corner;
  for (int a = 0; a < 3; ++a) place[a] = cellWithin(axes[a].at(span.first), 0, frame.last[a]);
  for (double t = span.first;;) {
    const std::int64_t width = std::int64_t{1} << (kMaxDepth - locate(field.data(), pointIn(place)).depth);
    std::array<double, 3> leave;
    for (int a = 0; a < 3; ++a) {
      corner[a] = place[a] & ~(width - 1);
      leave[a] = axes[a].speed > 0   ? axes[a].when(corner[a] + width)
                 : axes[a].speed < 0 ? axes[a].when(corner[a])
                                     : std::numeric_limits<double>::infinity();
    }
    const double next = *std::ranges::min_element(leave);
    if (const double end = std::min(next, span.last); end - t > kShortest) {
      pieces.push_back({field.cellAt(centerOf(frame, corner, width)), t, end});
      t = end;
    }
    if (next >= span.last) return pieces;
    for (int a = 0; a < 3; ++a) {
      if (leave[a] == next)
        place[a] = axes[a].speed > 0 ? corner[a] + width : corner[a] - 1;
      else
        place[a] = cellWithin(axes[a].at(next), corner[a], corner[a] + width - 1);
      if (place[a] < 0 || place[a] > frame.last[a]) return pieces;
    }
  }
}

Vector3 pointAt(const Vector3& from, const Vector3& to, double t) {
  return {std::lerp(from.x(), to.x(), t), std::lerp(from.y(), to.y(), t), std::lerp(from.z(), to.z(), t)};
}

/// Of a piece outside of the domain. On the wall itself the leaf there would answer, whose gradient is another one: its
/// limit is taken a little way out.
ValueAndGradient continued(const Field& field, const Line& line, const Piece& piece, double t) {
  constexpr double kAside = 1e-9;
  const double margin = kAside * (piece.tLeave - piece.tEnter);
  const double aside = std::clamp(t, piece.tEnter + margin, piece.tLeave - margin);
  return {field.value(pointAt(line.from, line.to, t)),
          field.valueAndGradient(pointAt(line.from, line.to, aside)).gradient};
}

}  // namespace

std::vector<Piece> piecesAlong(const Field& field, const Vector3& from, const Vector3& to) {
  if (from == to) throw Error("a segment's ends are one and the same point: give two");
  const GridFrame& frame = field.lookupGrid().frame;
  const Axes axes = axesOf(frame, from, to);
  const std::optional<Span> span = spanWithin(axes);
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

ValueAndGradient valueAndGradientIn(const Field& field, const Cell& cell, const Vector3& x) {
  const GridFrame& frame = field.lookupGrid().frame;
  std::array<double, 3> coordinates;
  std::array<std::int64_t, 3> place;
  for (int axis = 0; axis < 3; ++axis) {
    coordinates[axis] = gridCoordinate(frame, axis, x[axis]);
    place[axis] = std::llround(std::ldexp(gridCoordinate(frame, axis, cell.box.min()[axis]), cell.depth));
  }
  const FoundLeaf leaf = leafWithin(field.data().nodes[cell.id], cell.depth, cell.id, place, coordinates);
  return answerWithin<ValueAndGradient>(field.data(), field.lookupGrid(), coordinates, leaf);
}

Line sampleLine(const Field& field, const Vector3& from, const Vector3& to, int count) {
  assert(count >= 2);
  Line line{from, to, piecesAlong(field, from, to), {}};
  line.samples.reserve(static_cast<std::size_t>(count) + 2 * line.pieces.size());
  int even = 0;  // of the evenly spaced samples, the next
  const auto evenAt = [&] { return static_cast<double>(even) / (count - 1); };
  for (std::size_t n = 0; n < line.pieces.size(); ++n) {
    const Piece& piece = line.pieces[n];
    const auto add = [&](double t) {
      const Vector3 x = pointAt(from, to, t);
      const auto [value, gradient] =
          piece.cell ? valueAndGradientIn(field, *piece.cell, x) : continued(field, line, piece, t);
      line.samples.push_back({t, n, x, value, gradient});
    };
    add(piece.tEnter);
    while (even < count && evenAt() <= piece.tEnter) ++even;
    for (; even < count && evenAt() < piece.tLeave; ++even) add(evenAt());
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
