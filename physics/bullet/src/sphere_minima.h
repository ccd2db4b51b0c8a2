#pragma once
// The points of a sphere at which it penetrates a field most deeply: one point for each side on which the
// sphere touches the field.

#include <span>
#include <vector>

#include "hpsdf/field.h"

namespace hpsdf::physics {

/// A local minimum of the field over a sphere, or an approximation of one during the descent.
struct SphereMinimum {
  Vector3 direction = Vector3::UnitX();  ///< unit vector from the sphere's centre
  double value = 0;                      ///< field value at the point of the sphere in this direction
  Vector3 slope = Vector3::Zero();       ///< component of the field's gradient tangential to the sphere
  double step = 1;                       ///< length of the next descent step, in radii, for a slope of 1
};

/// Finds the minima of a field over a sphere that moves a little from step to step. Each search also starts
/// from the minima of the previous search.
class SphereMinima {
 public:
  static constexpr std::size_t kMost = 12;

  /// Returns the minima whose value is at most `margin`, the lowest first. Allocates no memory after the
  /// first few calls.
  std::span<const SphereMinimum> find(const Field& field, const Vector3& center, double radius, double margin);
  void forget() { minima_.clear(); }

 private:
  std::vector<SphereMinimum> minima_;
};

}  // namespace hpsdf::physics
