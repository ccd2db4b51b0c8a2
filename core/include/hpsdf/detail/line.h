#pragma once
// A field along a segment: the leaves that the segment crosses, and samples within each of these leaves.

#include <cstddef>
#include <optional>
#include <vector>

#include "hpsdf/field.h"

namespace hpsdf {

/// The part of a segment that lies within one leaf, or a part that lies outside the domain.
struct Piece {
  std::optional<Cell> cell;  ///< empty outside the domain
  double tEnter, tLeave;     ///< ends of the piece, 0 at the segment's start and 1 at its end; tEnter < tLeave
};

/// Cuts a segment into pieces at the faces of leaves. The pieces are in order of the parameter t from 0 to 1, and each
/// piece begins where the previous piece ends. Leaves are half-open. Therefore a segment that runs along a face or an
/// edge belongs to the leaf on the side of greater coordinates, and a segment through an edge or a corner continues in
/// the opposite leaf. Leaves that hold less than 1e-12 of the segment are left out, because rounding decides whether
/// the segment crosses them. Throws `Error` if the points are equal or not finite.
std::vector<Piece> piecesAlong(const Field& field, const Vector3& from, const Vector3& to);

struct LineSample {
  double t;           ///< position along the segment, 0 at its start and 1 at its end
  std::size_t piece;  ///< index into `Line::pieces`
  Vector3 point;
  double value;
  Vector3 gradient;
};

/// Samples of a field along a segment. Where two pieces of the segment meet, there are two samples with equal t: one
/// holds the limits of value and gradient from the first piece, the other from the second. A plot therefore shows jumps
/// as steps.
struct Line {
  Vector3 from, to;
  std::vector<Piece> pieces;
  std::vector<LineSample> samples;  ///< in the order of t

  /// Returns the segment's length. The length is correct even if its square would underflow or overflow.
  double length() const { return (to - from).stableNorm(); }
  /// Returns the component of the sample's gradient in the direction of the segment.
  double slopeAlong(const LineSample& sample) const { return sample.gradient.dot(to - from) / length(); }
};

/// Samples a field at `count` ≥ 2 evenly spaced points of a segment, including its ends, and at both ends of every
/// piece of the segment. Within the domain, the value and the gradient of a sample are limits from the leaf that
/// contains the sample's piece of the segment. Outside the domain, they come from the field's continuation. Throws
/// `Error` as `piecesAlong` does.
Line sampleLine(const Field& field, const Vector3& from, const Vector3& to, int count);

/// The jump of a field f at the point where a segment crosses from one leaf to the next leaf.
struct LineJump {
  double t;      ///< position along the segment, 0 at its start and 1 at its end
  double value;  ///< f after the crossing minus f before the crossing
};

/// Returns the jumps at all points within the domain where the line crosses from leaf to leaf, in order along
/// the line.
std::vector<LineJump> jumpsAlong(const Line& line);

}  // namespace hpsdf
