#pragma once

// Proven upper bounds of the error and of the slope of the field in each leaf.

#include <atomic>
#include <cstdint>
#include <span>

#include "hpsdf/build_options.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {

/// Computes proven bounds of the error and of the slope in each leaf, and stores them in `field.bounds`; see
/// `withBounds`. Uses the threads of the calling TBB arena. Returns the number of evaluations of the exact distance.
std::uint64_t findBounds(FieldData& field, const DistanceFunction& distance, const Progress& progress);

/// The polynomial of a cell, in the cell's local coordinates, and the distance that it approximates.
struct CellPolynomial {
  std::span<const double> coefficients;
  int degree;
  const Box& cell;
  const Box& domain;  ///< where the distance may be evaluated
  const DistanceFunction& distance;
};

/// Returns true if it is proven that a polynomial's error does not exceed the allowed error less `rounding` at any
/// point of its cell. The distance must be a signed distance, whose slope is at most 1. Where the bounds of the octants
/// of the cell prove nothing, the octants are halved again, up to twice. Adds the number of evaluated distances to
/// `evaluations`. Thread-safe.
bool isProvenWithin(const CellPolynomial& polynomial, const AllowedError& allowed, double rounding,
                    std::atomic<std::uint64_t>& evaluations);

}  // namespace hpsdf::detail
