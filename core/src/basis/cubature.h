#pragma once
// Quadrature over the reference cube [-1, 1]³.

#include <optional>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf {

/// Points and weights; the weights sum to 8.
struct Cubature {
  std::vector<Vector3> points;
  std::vector<double> weights;
};

/// Exact for polynomials of total degree `order` from about half as many points as a product of Gauss rules: 14, 34,
/// 58, 90, 148 points for orders up to 5, 7, 9, 11, 13. Symmetric under every symmetry of the cube, all points inside,
/// all weights positive. None for orders beyond.
std::optional<Cubature> compactCubature(int order);

}  // namespace hpsdf
