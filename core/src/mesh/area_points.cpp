#include "mesh/area_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "hpsdf/error.h"

namespace hpsdf::mesh {

std::size_t SelectBySize::draw(detail::Random& random) const {
  const auto found = std::ranges::upper_bound(prefixSums_, random.unit() * prefixSums_.back());
  return std::min(std::size_t(found - prefixSums_.begin()), prefixSums_.size() - 1);
}

AreaPoints::AreaPoints(const TriangleMesh& mesh) : mesh_(mesh) {
  triangles_.reserve(mesh.triangles.size());
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    triangles_.add((b - a).cross(c - a).norm() / 2);
  }
  if (!(triangles_.total() > 0))
    throw Error("points near the surface: the surface has no area; give a mesh with faces");
}

AreaPoints::Drawn AreaPoints::drawOnTriangle(detail::Random& random) const {
  const std::size_t triangle = triangles_.draw(random);
  const auto [a, b, c] = cornersOf(mesh_, mesh_.triangles[triangle]);
  const double side = std::sqrt(random.unit()), along = random.unit();
  return {(1 - side) * a + side * (1 - along) * b + side * along * c, triangle};
}

Vector3 AreaPoints::draw(detail::Random& random) const { return drawOnTriangle(random).point; }

Vector3 AreaPoints::drawWithin(double reach, detail::Random& random) const {
  const Drawn drawn = drawOnTriangle(random);
  const auto [a, b, c] = cornersOf(mesh_, mesh_.triangles[drawn.triangle]);
  return drawn.point + reach * (2 * random.unit() - 1) * (b - a).cross(c - a).normalized();
}

}  // namespace hpsdf::mesh
