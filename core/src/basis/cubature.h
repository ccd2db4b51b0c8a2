#pragma once
// Quadrature rules over the reference cube [-1, 1]³.

#include <optional>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::basis {

/// A quadrature rule over a cube: points in [-1, 1]³ and their weights, whose sum is 8.
struct Cubature {
  std::vector<Vector3> points;
  std::vector<double> weights;
};

/// Returns a quadrature rule that is exact for polynomials up to total degree `order`. It needs about half as many
/// points as a tensor product of Gauss rules: 14, 34, 58, 90, 148 points for orders up to 5, 7, 9, 11, 13. The rule is
/// invariant under the symmetries of the cube, all its points lie inside the cube and all its weights are positive.
/// Returns std::nullopt for orders above 13.
std::optional<Cubature> compactCubature(int order);

}  // namespace hpsdf::basis
