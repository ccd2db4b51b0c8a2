#pragma once
// Contours of random combinations of solids, which are the same on every machine.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/combine/combined_distance.h"
#include "hpsdf/continuity.h"
#include "hpsdf/output/contour.h"
#include "hpsdf/shapes.h"
#include "support/random_expression.h"

namespace hpsdf::support {

/// Returns the blended field of a distance.
inline Field blendedField(const DistanceFunction& distance, const Box& domain, double targetError = 1e-5) {
  Field field = build(distance, domain, {.targetError = targetError});
  return field.data().blend == 0 ? blended(field) : field;
}

/// Returns a domain around a combined solid, with a margin of a tenth of the solid's longest side.
inline Box domainAround(const CombinedDistance& combined) {
  const Box box = combined.source().box;
  const Vector3 margin = Vector3::Constant(0.1 * box.sizes().maxCoeff());
  return Box(Vector3(box.min() - margin), Vector3(box.max() + margin));
}

struct CombinedContour {
  std::uint64_t seed;  ///< as in `randomExpression`
  Contour contour;
};

/// Returns the contours of the first `count` random combinations of built-in shapes of which something is left.
inline std::vector<CombinedContour> contoursOfCombinations(std::size_t count) {
  const std::vector<Expression> solids = {shapes::mesh("sphere"), shapes::mesh("box"), shapes::mesh("torus"),
                                          shapes::mesh("gear")};
  std::vector<CombinedContour> made;
  for (std::uint64_t seed = 1; made.size() < count; ++seed) {
    try {
      const CombinedDistance combined(randomExpression(seed, solids));
      const Field field = blendedField(combined, domainAround(combined));
      Contour found = contour(field, {.tolerance = 0.01 * combined.source().box.sizes().maxCoeff()});
      if (!found.mesh.triangles.empty()) made.push_back({seed, std::move(found)});
    } catch (const Error& error) {
      if (std::string(error.what()).find("nothing is left") == std::string::npos) throw;
    }
  }
  return made;
}

}  // namespace hpsdf::support
