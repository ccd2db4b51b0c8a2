#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hpsdf/field.h"

namespace hpsdf::physics {

/// A field with what tells, for the price of one look at a table, where it cannot be low.
///
/// A field is only nearly a distance: it may change by more than the way between two points, and it jumps. So what a
/// sphere's centre says of the sphere is certain only with a slack, which is large where the field is coarse. The
/// collider keeps the greatest function below the field that is a distance in that sense, |g(x) - g(y)| ≤ |x - y|, as
/// nearly as a grid of cells can tell it: bounds of the leaves' polynomials, of all that are blended there, and what
/// lower ones elsewhere take from them. It is certain for every field, with stored bounds or without.
class FieldCollider {
 public:
  /// Refers to the field, which must outlive it.
  explicit FieldCollider(const Field& field);
  explicit FieldCollider(Field&&) = delete;

  const Field& field() const { return *field_; }

  /// 0 or more; the field at x is no less, or negative where this is 0. x may be infinite, not NaN; so below.
  double lowerBound(const Vector3& x) const;

  /// 0 or more; at any distance r of x at which this less r is above 0 the field is no less than that.
  double lowerBoundAround(const Vector3& x) const;

  std::size_t bytes() const { return cells_.size() * sizeof(cells_[0]); }

 private:
  /// In `unit_`, rounded down.
  struct Cell {
    std::uint16_t within;  ///< at most the field, within the cell
    std::uint16_t around;  ///< at most the field at any point, and the way there from any of the cell's
  };

  const Cell& cellAt(const Vector3& inDomain) const;

  const Field* field_;
  int depth_;                         ///< of the octree's cells that are the grid's
  std::array<std::int64_t, 3> size_;  ///< cells
  double unit_;
  double wall_;              ///< the least of the field at the domain's sides or, if that is above 0, of `around` there
  std::vector<Cell> cells_;  ///< x fastest
};

}  // namespace hpsdf::physics
