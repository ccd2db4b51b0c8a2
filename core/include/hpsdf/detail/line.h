#pragma once
// A field along a segment: the leaves that the segment crosses, and samples within each.

#include <cstddef>
#include <optional>
#include <vector>

#include "hpsdf/field.h"

namespace hpsdf {

/// The part of a segment within one leaf, or a part outside the domain.
struct Piece {
  std::optional<Cell> cell;  ///< empty outside the domain
  double tEnter, tLeave;     ///< ends of the piece, 0 at the segment's start and 1 at its end; tEnter < tLeave
};

/// Cuts a segment at the faces that it crosses. The pieces are in order from 0 to 1, and each begins where the one
/// before it ends. Leaves are half-open, so that a segment along a face or an edge runs through the leaves of greater
/// coordinates, and one through an edge or a corner continues in the opposite leaf. Leaves that hold less than 1e-12 of
/// the segment are left out, because rounding decides about them. Throws `Error` if the points are equal or not finite.
std::vector<Piece> piecesAlong(const Field& field, const Vector3& from, const Vector3& to);

struct LineSample {
  double t;           ///< position along the segment, 0 at its start and 1 at its end
  std::size_t piece;  ///< index into `Line::pieces`
  Vector3 point;
  double value;
  Vector3 gradient;
};

/// Samples of a field along a segment. Where two pieces meet, two samples with equal t hold the limits from both
/// pieces, so that a plot shows jumps as steps.
struct Line {
  Vector3 from, to;
  std::vector<Piece> pieces;
  std::vector<LineSample> samples;  ///< in the order of t

  /// Returns the segment's length, even if its square would vanish or overflow.
  double length() const { return (to - from).stableNorm(); }
  /// Returns the gradient's component along the segment.
  double slopeAlong(const LineSample& sample) const { return sample.gradient.dot(to - from) / length(); }
};

/// Samples a field at `count` ≥ 2 evenly spaced points, which include the segment's ends, and at both ends of every
/// piece. Samples within the domain are limits from the piece's leaf, those outside use the field's continuation.
/// Throws `Error` as `piecesAlong` does.
Line sampleLine(const Field& field, const Vector3& from, const Vector3& to, int count);

/// The jump of f where a segment crosses from one leaf to the next.
struct LineJump {
  double t;      ///< position along the segment, 0 at its start and 1 at its end
  double value;  ///< f after the crossing less f before it
};

/// Returns the jumps at all crossings within the domain, in order.
std::vector<LineJump> jumpsAlong(const Line& line);

}  // namespace hpsdf
