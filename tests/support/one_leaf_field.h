#pragma once

#include <array>
#include <random>
#include <vector>

#include "hpsdf/field.h"

namespace hpsdf {

/// Returns a field of one leaf with random coefficients up to `degree`, over a box that is not a cube.
inline Field oneLeafField(unsigned seed, int degree) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> coefficients(static_cast<std::size_t>(coefficientCount(degree)));
  for (double& c : coefficients) c = normal(random);
  FieldData data;
  data.domain = Box(Vector3(-1, 0.5, 2), Vector3(1.5, 2, 5));
  data.nodes = {node::leaf(degree, 0)};
  data.coefficients = std::move(coefficients);
  return Field(std::move(data));
}

}  // namespace hpsdf
