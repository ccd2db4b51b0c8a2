#pragma once
// Quadrature over the reference cube [-1, 1]³.

#include <optional>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::basis {

/// Points in [-1, 1]³ and weights whose sum is 8.
struct Cubature {
  std::vector<Vector3> points;
  std::vector<double> weights;
};

/// A cubature that is exact for polynomials of total degree `order` and takes about half as many points as a tensor
/// product of Gauss rules: 14, 34, 58, 90, 148 points for orders up to 5, 7, 9, 11, 13. The rule is invariant under the
/// symmetries of the cube, all points lie inside and all weights are positive. Empty for orders above 13.
std::optional<Cubature> compactCubature(int order);

}  // namespace hpsdf::basis
