#pragma once
// A field along a segment: the leaves that it passes, and what each of them says there.

#include <cstddef>
#include <optional>
#include <vector>

#include "hpsdf/field.h"

namespace hpsdf {

/// The part of a segment within one leaf, or one end of it outside of the domain.
struct Piece {
  std::optional<Cell> cell;  ///< none outside of the domain
  double tEnter, tLeave;     ///< along the segment: 0 at its first point, 1 at its last; tEnter < tLeave
};

/// Cuts a segment at the faces that it crosses: pieces in order from 0 to 1, each beginning where the one before ends.
/// Leaves are half-open: a segment along a face or an edge runs through those of greater coordinates. Through an edge
/// or a corner it goes to the leaf on the other side at once; leaves that hold less than 1e-12 of it are left out,
/// since rounding decides on them. Throws `Error` where the points are equal or not finite.
std::vector<Piece> piecesAlong(const Field& field, const Vector3& from, const Vector3& to);

/// As `Field::valueAndGradient` answers for a point of this leaf; on its faces, the limits from within. Without
/// blending it is the leaf's polynomial wherever x is.
ValueAndGradient valueAndGradientIn(const Field& field, const Cell& cell, const Vector3& x);

struct LineSample {
  double t;
  std::size_t piece;  ///< its number
  Vector3 point;
  double value;
  Vector3 gradient;
};

/// Samples of a segment. Where two pieces meet there are two of one t, the limits from either side, so that jumps are
/// steps.
struct Line {
  Vector3 from, to;
  std::vector<Piece> pieces;
  std::vector<LineSample> samples;  ///< t ascends

  double length() const { return (to - from).stableNorm(); }  // though its square may vanish or overflow
  /// The gradient's component along the segment: the value's change per length.
  double slopeAlong(const LineSample& sample) const { return sample.gradient.dot(to - from) / length(); }
};

/// `count` ≥ 2 evenly spaced samples, the two ends among them, and both ends of every piece; within the domain from
/// within the piece's own leaf, outside of it by the field's continuation. Throws as `piecesAlong` does.
Line sampleLine(const Field& field, const Vector3& from, const Vector3& to, int count);

/// A border between two leaves on a segment.
struct LineJump {
  double t;
  double value;  ///< f after it less f before
};

/// At each border within the domain, in order.
std::vector<LineJump> jumpsAlong(const Line& line);

}  // namespace hpsdf
