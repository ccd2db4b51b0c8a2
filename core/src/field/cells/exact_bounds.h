#pragma once
// Bounds of the error of exact leaves.

#include <array>
#include <cstdint>
#include <vector>

#include "field/query/leaves.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/detail/lookup_grid.h"
#include "hpsdf/distance_function.h"

namespace hpsdf::detail {

/// Bounds how far exact leaves are from the signed distance Φ to the triangles from which they were made.
class ExactBounds {
 public:
  /// Keeps references to the field and to the distance, which must be the distance that the field was made from.
  ExactBounds(const FieldData& field, const DistanceFunction& distance);

  /// Returns an upper bound of the error of an exact leaf in its box, which consists of rounding errors alone.
  double error(const query::OctreeNode& leaf) const;

  /// Returns an upper bound of the error of an exact leaf wherever it has a weight in a blended field. It is hardly
  /// more than `error` if the leaf's list contains all triangles that can be nearest there.
  double errorAround(const query::OctreeNode& leaf) const;

 private:
  using Corners = std::array<std::array<double, 3>, 3>;

  Corners cornersOf(std::uint32_t triangle) const;
  bool isComplete(const query::OctreeNode& leaf, const Box& around) const;

  const FieldData& field_;
  GridFrame frame_;
  const TriangleSearch* search_;
  std::vector<Vector3> vertices_;
  double vertexError_ = 0;      ///< greatest distance by which a vertex may have been rounded
  double coordinateError_ = 0;  ///< greatest rounding error of the world coordinates of a query point
  double reach_ = 0;            ///< greatest distance between a point of the domain and a vertex
};

}  // namespace hpsdf::detail
