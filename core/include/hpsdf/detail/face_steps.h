#pragma once
// Jumps of a field's value and gradient between leaves, measured by queries on both sides of the leaves' faces.

#include <cstddef>
#include <cstdint>

#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// The greatest differences between queries of a field on opposite sides of the faces of its leaves.
struct FaceSteps {
  std::size_t points = 0;  ///< number of points at which both sides were queried
  double value = 0;        ///< greatest difference of f, in the field's units
  double gradient = 0;     ///< greatest length of the difference of the gradients

  void add(const FaceSteps& other);
};

/// Queries a field on both sides of the interfaces between its leaves (`Interface`), at `count` random points. Each
/// point lies on a random interface; small ones are chosen as often as large ones. At each point the field is queried
/// at two positions that lie in different leaves and differ only by the spacing of floating-point numbers. The result
/// depends on the seed, not on `threads` (0: all that the machine offers). Throws `Cancelled` when `progress` says so.
FaceSteps stepsAcrossFaces(const Field& field, std::size_t count, std::uint64_t seed = 1, int threads = 0,
                           const Progress& progress = {});

}  // namespace hpsdf
