#pragma once
// Where a sphere is deepest in a field: a place for each side on which it touches.

#include <span>
#include <vector>

#include "hpsdf/field.h"

namespace hpsdf::physics {

/// A point of a sphere, on its way to where the field's value is least all around.
struct Foot {
  Vector3 direction = Vector3::UnitX();  ///< from the sphere's centre; of length 1
  double value = 0;                      ///< the field's
  Vector3 slope = Vector3::Zero();       ///< its gradient along the sphere
  double reach = 1;                      ///< how far to go against the slope, in radii
};

/// Of one sphere that moves a little from step to step: what it found before is where it looks first.
class SphereFeet {
 public:
  static constexpr std::size_t kMost = 12;

  /// Those whose value is `margin` at most, the lowest first. Allocates nothing after the first calls.
  std::span<const Foot> find(const Field& field, const Vector3& center, double radius, double margin);
  void forget() { feet_.clear(); }

 private:
  std::vector<Foot> feet_;
};

}  // namespace hpsdf::physics
