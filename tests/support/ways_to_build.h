#pragma once
// Distances and settings that between them take every way through a construction by errors.

#include <algorithm>
#include <vector>

#include "hpsdf/build_options.h"
#include "hpsdf/types.h"

namespace hpsdf::support {

/// Signed distance to two spheres; it has a kink halfway between them.
inline double spheres(const Vector3& x) {
  return std::min((x - Vector3(0.5, 0.1, 0)).norm() - 0.4, (x + Vector3(0.5, 0, 0.2)).norm() - 0.35);
}
inline Box cube(double half = 1.1) { return Box(Vector3::Constant(-half), Vector3::Constant(half)); }

inline std::vector<BuildOptions> everyWay() {
  BuildOptions paper = paperOptions();
  paper.targetError = 1e-6;
  paper.grid = {3, 3, 3};
  return {
      {.targetError = 1e-7, .grid = {3, 3, 3}},
      paper,
      {.targetError = 1e-6, .criterion = Criterion::optimal},
      {.targetError = 1e-5, .grid = {3, 3, 3}, .criterion = Criterion::optimal, .strategy = Strategy::h2},
      {.targetError = 1e-6,
       .grid = {2, 3, 4},
       .maxSteps = 100,
       .enrich = true,
       .coefficients = CoefficientType::float64},
      {.targetError = NearFarError{3e-4, 3e-3}, .band = 0.3},
      {.targetError = NearFarError{3e-4, 3e-4}, .criterion = Criterion::optimal},  // defers refinement of some leaves
      {.targetError = 0, .maxError = 0.02},
      {.targetError = 1e-5, .maxError = 0.02, .band = 0.2},
      {.targetError = 0, .grid = {3, 3, 3}, .maxError = 0.01, .maxBytes = 150000},
      {.targetError = 0, .maxBytes = 200000, .criterion = Criterion::optimal},
      {.targetError = 1e-5, .nearnessKind = NearnessKind::exponential, .estimator = Estimator::residual},
      {.targetError = 1e-5, .estimator = Estimator::checked, .criterion = Criterion::optimal},
      {.targetError = 1e-5, .continuityWeight = 0.1, .blend = 0.1, .bounds = true},
      {.targetError = 1e-6, .grid = {17, 17, 17}, .maxSteps = 40},  // base cells in two batches
  };
}

/// Returns settings with which the construction makes exact leaves.
inline std::vector<BuildOptions> everyWayToExactLeaves() {
  std::vector<BuildOptions> ways = {
      {.targetError = 1e-5, .grid = {3, 3, 3}},
      {.targetError = 1e-4, .grid = {3, 3, 3}, .criterion = Criterion::optimal},
      {.targetError = 0, .grid = {3, 3, 3}, .maxError = 0.1},
      {.targetError = 0, .grid = {3, 3, 3}, .maxBytes = 100000, .criterion = Criterion::optimal},
      {.targetError = 1e-3, .grid = {3, 3, 3}, .continuityWeight = 0.1, .blend = 0.1, .bounds = true},
      // The first cells come in two batches, and some cells of the second one are divided before they are fitted.
      {.targetError = 1e-4, .grid = {17, 17, 17}, .criterion = Criterion::optimal, .exactTriangles = 8, .maxSteps = 5}};
  for (BuildOptions& options : ways) options.strategy = Strategy::hpx, options.maxDegree = 5;
  return ways;
}

}  // namespace hpsdf::support
