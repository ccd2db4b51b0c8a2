#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "hpsdf/field.h"

namespace hpsdf {

struct RandomFieldOptions {
  Box domain = Box(Vector3(-1, -1, -1), Vector3(1, 1, 1));
  std::array<std::uint32_t, 3> grid = {2, 2, 2};
  double radius = 0.6;      ///< radius of the sphere, about the domain's centre, that the field approximates
  double roughness = 0.2;   ///< size of the random coefficients that are added, relative to the cell's size
  double refinement = 0.4;  ///< probability that a cell is divided
  int maxDepth = 4;
  std::optional<Vector3> deepAt = {};  ///< cells that contain this point are divided down to maxDepth
  int minDegree = 1;
  int maxDegree = 6;
  bool single = false;  ///< whether coefficients are stored as float
};

/// Makes a field that is as irregular as the interface allows: in each cell the linear part of a sphere's distance plus
/// random terms of every degree. It jumps from leaf to leaf, is far from 1-Lipschitz, and has zeros in many places.
inline Field randomField(unsigned seed, const RandomFieldOptions& options = {}) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  FieldData data;
  data.domain = options.domain;
  data.grid = options.grid;
  std::vector<double> coefficients;
  struct Pending {
    std::size_t node;
    Box box;
    int depth;
  };
  std::vector<Pending> pending;
  const Vector3 cell = options.domain.sizes().cwiseQuotient(Vector3(options.grid[0], options.grid[1], options.grid[2]));
  for (std::uint32_t z = 0; z < options.grid[2]; ++z)
    for (std::uint32_t y = 0; y < options.grid[1]; ++y)
      for (std::uint32_t x = 0; x < options.grid[0]; ++x) {
        const Vector3 lo = options.domain.min() + cell.cwiseProduct(Vector3(x, y, z));
        pending.push_back({data.nodes.size(), Box(lo, lo + cell), 0});
        data.nodes.push_back(0);
      }
  for (std::size_t next = 0; next < pending.size(); ++next) {
    const Pending at = pending[next];
    const Vector3 center = at.box.center();
    const Vector3 half = 0.5 * at.box.sizes();
    const bool deep = options.deepAt && at.box.contains(*options.deepAt);
    if (at.depth < options.maxDepth && (deep || unit(random) < options.refinement)) {
      data.nodes[at.node] = node::internal(std::uint32_t(data.nodes.size()));
      for (int child = 0; child < 8; ++child) {
        const Vector3 corner(child & 1 ? center.x() : at.box.min().x(), child & 2 ? center.y() : at.box.min().y(),
                             child & 4 ? center.z() : at.box.min().z());
        pending.push_back({data.nodes.size(), Box(corner, corner + half), at.depth + 1});
        data.nodes.push_back(0);
      }
      continue;
    }
    const int degree = options.minDegree + static_cast<int>(unit(random) * (options.maxDegree - options.minDegree + 1));
    data.nodes[at.node] = node::leaf(degree, std::uint32_t(coefficients.size()));
    const Vector3 fromCenter = center - options.domain.center();
    const Vector3 gradient = fromCenter.normalized();
    for (int i = 0; i <= degree; ++i)
      for (int j = 0; j <= degree - i; ++j)
        for (int k = 0; k <= degree - i - j; ++k) {
          double c = options.roughness * half.minCoeff() * normal(random) / std::pow(2 + i + j + k, 2);
          if (i + j + k == 0) c += fromCenter.norm() - options.radius;
          if (i + j + k == 1) c += gradient[i ? 0 : j ? 1 : 2] * half[i ? 0 : j ? 1 : 2];
          coefficients.push_back(c);
        }
  }
  if (options.single)
    data.coefficients = std::vector<float>(coefficients.begin(), coefficients.end());
  else
    data.coefficients = std::move(coefficients);
  return Field(std::move(data));
}

}  // namespace hpsdf
