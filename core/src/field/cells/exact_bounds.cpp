#include "field/cells/exact_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <variant>

#include "field/cells/exact_lists.h"
#include "field/query/evaluate.h"
#include "field/query/float_coefficients.h"
#include "hpsdf/detail/triangle_list.h"
#include "hpsdf/detail/triangle_search.h"

namespace hpsdf::detail {
namespace {

bool hasOnlyFloats(const TriangleSearch& search) {
  return std::ranges::all_of(search.vertices(), [](const Vector3& v) { return query::throughFloat(v) == v; });
}

/// Returns the greatest distance between a vertex of three floats and a vertex that was rounded to it.
double roundingOf(const Eigen::Vector3f& vertex) {
  Vector3 steps;
  for (int axis = 0; axis < 3; ++axis) {
    const float size = std::abs(vertex[axis]);
    steps[axis] = double(std::nextafter(size, std::numeric_limits<float>::infinity())) - double(size);
  }
  return steps.norm() / 2;
}

}  // namespace

ExactBounds::ExactBounds(const FieldData& field, const DistanceFunction& distance)
    : field_(field), frame_(query::gridFrame(field)), search_(distance.triangleSearch()) {
  std::visit(
      [&](const auto& vertices) {
        vertices_.reserve(vertices.size());
        for (const auto& vertex : vertices) vertices_.push_back(vertex.template cast<double>());
      },
      field.exact.vertices);
  const auto* floats = std::get_if<std::vector<Eigen::Vector3f>>(&field.exact.vertices);
  if (floats != nullptr && (search_ == nullptr || !hasOnlyFloats(*search_)))
    for (const Eigen::Vector3f& vertex : *floats) vertexError_ = std::max(vertexError_, roundingOf(vertex));
  Box all = field.domain;
  for (const Vector3& vertex : vertices_) all.extend(vertex);
  reach_ = all.diagonal().norm();
  coordinateError_ = 8 * std::numeric_limits<double>::epsilon() *
                     (all.min().cwiseAbs().cwiseMax(all.max().cwiseAbs()).norm() + reach_);
}

ExactBounds::Corners ExactBounds::cornersOf(std::uint32_t triangle) const {
  Corners corners;
  for (int k = 0; k < 3; ++k) Vector3::Map(corners[k].data()) = vertices_[field_.exact.triangles[triangle][k]];
  return corners;
}

/// The error has three parts.
///
/// A vertex that is moved by δ moves no point of its triangles by more than δ, and hence changes no distance by more
/// than δ. The sign stays right as long as the triangles keep their orientation and do not intersect each other;
/// `roundVertices` sees to the former.
///
/// The leaf is evaluated at a point that differs from the query point by the rounding error of its coordinates.
///
/// The distance to the plane of a thin triangle has a rounding error (`query::thinness`). The distance to a side does
/// not depend on the normal.
double ExactBounds::error(const query::OctreeNode& leaf) const {
  constexpr double kEpsilon = 16 * std::numeric_limits<double>::epsilon();
  const double thinnest = query::thinness(field_.exact, field_.nodes[leaf.node]);
  return vertexError_ + coordinateError_ + std::min(kEpsilon * thinnest, 1.0) * reach_;
}

/// Returns true if the leaf's list contains all triangles that can be nearest to a point of the box `around`, for each
/// of its octants.
bool ExactBounds::isComplete(const query::OctreeNode& leaf, const Box& around) const {
  if (search_ == nullptr) return false;
  const bool isSingle = std::holds_alternative<std::vector<Eigen::Vector3f>>(field_.exact.vertices);
  const TriangleListView list(field_.exact, field_.nodes[leaf.node]);
  std::map<Corners, std::uint8_t> listed;  // octants by triangle
  std::uint32_t place = 0;
  forEachTriangle(field_.exact, field_.nodes[leaf.node],
                  [&](std::uint32_t triangle) { listed[cornersOf(triangle)] |= list.octants(place++); });
  constexpr std::size_t kLeast = 64;  // a search for fewer triangles gives up too early
  const auto nearest = search_->nearestTo(around, std::max<std::size_t>(list.count(), kLeast));
  if (!nearest) return false;
  for (std::size_t i = 0; i < nearest->triangles.size(); ++i) {
    const auto& triangle = search_->triangles()[nearest->triangles[i]];
    Corners corners;
    for (int k = 0; k < 3; ++k) {
      const Vector3& vertex = search_->vertices()[triangle[k]];
      Vector3::Map(corners[k].data()) = isSingle ? query::throughFloat(vertex) : vertex;
    }
    const auto found = listed.find(corners);
    if (found == listed.end() || (nearest->octants[i] & ~found->second) != 0) return false;
  }
  return true;
}

/// Beyond the box, the list may lack the nearest triangles. Let y be the point of the box that is closest to x, at the
/// distance r. If the sign is the same throughout the leaf, the field of the leaf is 1-Lipschitz like Φ, and at y the
/// two differ only by `error`. Hence they differ by at most 2r more at x. If the sign comes from triangles that lack
/// neighbours, it may be wrong. A wrong sign adds twice the distance, which is at most the distance at the centre of
/// the leaf plus the distance to the centre.
double ExactBounds::errorAround(const query::OctreeNode& leaf) const {
  const std::uint64_t bits = field_.nodes[leaf.node];
  const Box box = query::cellBox(frame_, leaf.depth, leaf.cellIndex);
  const Box around = boxOfWeight(box, field_.blend);
  const double rounding = error(leaf);
  if (isComplete(leaf, around)) return rounding;
  const double beyond = 2 * field_.blend * box.sizes().norm();
  const ExactSign rule = node::exactSign(bits);
  if (rule == ExactSign::positive || rule == ExactSign::negative) return rounding + beyond;
  double atCentre = 0;
  const Vector3 centre = box.center();
  query::evaluateExact(field_.exact, bits, 0, {&centre, 1}, &atCentre);
  return rounding + beyond + 2 * (std::abs(atCentre) + around.sizes().norm() / 2 + rounding);
}

}  // namespace hpsdf::detail
