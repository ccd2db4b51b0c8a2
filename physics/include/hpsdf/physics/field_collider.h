#pragma once
// A table of lower bounds of a field, with which collision queries skip most evaluations.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hpsdf/field.h"

namespace hpsdf::physics {

/// A field with a table of guaranteed lower bounds of it. A lookup costs a third of an evaluation.
///
/// A field only approximates a distance: between two points it may change by more than their distance, and it
/// jumps. Therefore its value at a sphere's centre bounds it within the sphere only with a slack, which is large
/// where the field is coarse. Let g be the greatest function below the field with |g(x) − g(y)| ≤ |x − y|. The
/// collider stores g as precisely as a grid of cells allows. The bounds are derived from bounds of the polynomials
/// of all leaves, blended neighbours included, so that they hold for every field, with stored bounds or without.
class FieldCollider {
 public:
  /// Refers to the field, which must outlive it.
  explicit FieldCollider(const Field& field);
  explicit FieldCollider(Field&&) = delete;

  const Field& field() const { return *field_; }

  /// A lower bound of the field at x, or 0 where the field may be negative; never below 0. Here and below x may be
  /// infinite, but not NaN.
  double lowerBound(const Vector3& x) const;

  /// A bound b ≥ 0 of the field around x: at every distance r < b from x the field is at least b − r.
  double lowerBoundAround(const Vector3& x) const;

  std::size_t bytes() const { return cells_.size() * sizeof(cells_[0]); }

 private:
  /// Lower bounds in multiples of `unit_`, rounded down.
  struct Cell {
    std::uint16_t within;  ///< lower bound of the field in the cell
    std::uint16_t around;  ///< lower bound of the field at any point plus its distance from any point of the cell
  };

  const Cell& cellAt(const Vector3& inDomain) const;

  const Field* field_;
  int depth_;                         ///< depth of octree cells that have the size of a grid cell
  std::array<std::int64_t, 3> size_;  ///< grid cells along each axis
  double unit_;
  double wall_;              ///< least field value at the domain's sides or, if that is above 0, least `around` there
  std::vector<Cell> cells_;  ///< bounds of all cells, x fastest
};

}  // namespace hpsdf::physics
