#pragma once

#include <optional>
#include <span>

#include "hpsdf/field.h"
#include "hpsdf/range.h"
#include "hpsdf/types.h"

namespace hpsdf::contouring {

/// A function whose zero set is the surface to be meshed: a field less the offset, and with a wall the greater of this
/// and the distance to a box. It is negative inside.
class ImplicitSurface {
 public:
  /// Values of a magnitude up to `thin` do not count as a change of sign. With `wall`, the solid ends at this distance
  /// within the field's domain.
  ImplicitSurface(const Field& field, double offset, double thin, std::optional<double> wall, int threads);

  void values(std::span<const Vector3> points, std::span<double> out) const;
  void valuesAndGradients(std::span<const Vector3> points, std::span<ValueAndGradient> out) const;

  /// Returns the field, whose gradients are those without the wall.
  const Field& field() const { return field_; }

  /// Returns the values that there are without the wall.
  void valuesWithoutWall(std::span<const Vector3> points, std::span<double> out) const;

  /// Removes the wall.
  void removeWall() { wall_.reset(); }

  /// Returns true if the value at x is that of the wall.
  bool isAtWall(const Vector3& x) const;

  /// Returns false if no value in a box can have another sign than its corners, which are inside or outside, and a
  /// magnitude above that of thin parts.
  bool mayChangeSign(const Box& box, bool isInside) const;

 private:
  const Field& field_;
  RangeIndex ranges_;
  double offset_;
  double thin_;
  std::optional<Box> wall_;
};

}  // namespace hpsdf::contouring
