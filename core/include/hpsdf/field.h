#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>

#include "hpsdf/detail/field_data.h"
#include "hpsdf/detail/lookup_grid.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// A hierarchical hp-adaptive signed distance field: immutable; every query is const, thread-safe and allocation-free.
///
/// Inside the domain the value is the polynomial of the leaf that holds the point; leaves are half-open, so that every
/// point has exactly one. The field jumps slightly from leaf to leaf, unless it is blended (`FieldData::blend`): then
/// f = Σ wₙ fₙ / Σ wₙ over the leaves n that reach a point, fₙ being their polynomials continued beyond their boxes and
/// wₙ products of smooth steps across their sides, so that value and gradient are continuous throughout the domain;
/// away from the faces the leaf answers alone, as before, to the bit.
///
/// Outside the domain it is f(q) + |x - q| with q the closest point of the domain, with the matching gradient: the
/// value is continuous across the domain's boundary. Jumps between two leaves there go on outwards; a blended field has
/// none outside either, and its gradient jumps at the boundary alone. It is an upper bound of a 1-Lipschitz field, so
/// that outside a value is no safe length for a step of sphere tracing. Of infinite points the value is infinite and
/// the gradient NaN.
class Field {
 public:
  /// Takes finished arrays; throws `Error` when they do not make a field (see `FieldData`).
  explicit Field(FieldData data);

  double value(const Vector3& x) const;
  ValueAndGradient valueAndGradient(const Vector3& x) const;

  /// Batched; the spans have equal length. The same results as one at a time.
  void values(std::span<const Vector3> points, std::span<double> out) const;
  void valuesAndGradients(std::span<const Vector3> points, std::span<ValueAndGradient> out) const;

  /// The leaf that holds x, or, for x outside, the domain's closest point.
  Cell cellAt(const Vector3& x) const;

  /// Calls `visit` for every leaf, in the order of the octree (base cells first to last, children 0 to 7).
  void forEachCell(const std::function<void(const Cell&)>& visit) const;

  const Box& domain() const { return data_.domain; }
  const std::array<std::uint32_t, 3>& grid() const { return data_.grid; }
  const FieldMetadata& metadata() const { return data_.metadata; }
  bool singlePrecision() const { return data_.coefficients.index() == 1; }

  /// The arrays themselves: for files, uploads and tests.
  const FieldData& data() const { return data_; }

  /// Where queries start: for uploads and tests too.
  const LookupGrid& lookupGrid() const { return lookupGrid_; }

  /// Bytes that queries need: nodes, coefficients, lookup grid, and bounds where they are kept.
  std::size_t bytes() const;

 private:
  FieldData data_;
  LookupGrid lookupGrid_;
};

/// Figures over a whole field.
struct FieldStatistics {
  std::size_t leaves = 0;
  std::size_t nodes = 0;
  std::size_t coefficients = 0;
  std::size_t bytes = 0;               ///< `Field::bytes`
  std::map<int, double> degreeVolume;  ///< degree → fraction of the domain's volume
  std::map<int, double> depthVolume;   ///< depth → fraction of the domain's volume
  std::map<int, std::size_t> degreeLeaves;
  std::map<int, std::size_t> depthLeaves;
};

FieldStatistics statistics(const Field& field);

}  // namespace hpsdf
