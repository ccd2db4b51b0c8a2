#include "hpsdf/detail/face_steps.h"

#include <algorithm>
#include <cmath>

#include "field/query/blend.h"
#include "field/query/evaluate.h"
#include "hpsdf/detail/random_points.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "util/chunks.h"

namespace hpsdf {
namespace {

/// Queries a field at grid coordinates, in which the faces of cells lie exactly at representable numbers.
ValueAndGradient queryAt(const Field& field, const std::array<double, 3>& gridCoordinates) {
  const LookupGrid& lookupGrid = field.lookupGrid();
  const query::GridPoint point = query::gridPoint(lookupGrid.frame, gridCoordinates);
  return query::evaluateInLeaf<ValueAndGradient>(field.data(), lookupGrid, gridCoordinates,
                                                 query::findLeaf(field.data(), lookupGrid, point));
}

/// Measures the jump of the field's value and gradient at a random point of a face.
FaceSteps stepAcross(const Field& field, const Interface& face, detail::Random& random) {
  const GridFrame& frame = field.lookupGrid().frame;
  const int depth = std::max(face.depths[0], face.depths[1]);  // The interface is a whole face of the smaller leaf.
  std::array<double, 3> above;
  for (int axis = 0; axis < 3; ++axis) {
    const double center = std::ldexp(query::gridCoordinate(frame, axis, face.center[axis]), depth);
    above[axis] = std::ldexp(axis == face.axis ? std::round(center) : std::floor(center) + random.unit(), -depth);
  }
  std::array<double, 3> below = above;
  below[face.axis] = std::nextafter(above[face.axis], 0.0);  // Cells are half-open: the face belongs to the upper leaf.
  const ValueAndGradient lower = queryAt(field, below), upper = queryAt(field, above);
  return {1, std::abs(upper.value - lower.value), (upper.gradient - lower.gradient).norm()};
}

}  // namespace

void FaceSteps::add(const FaceSteps& other) {
  points += other.points;
  value = std::max(value, other.value);
  gradient = std::max(gradient, other.gradient);
}

FaceSteps stepsAcrossFaces(const Field& field, std::span<const Interface> faces, std::size_t count, std::uint64_t seed,
                           int threads, const Progress& progress) {
  if (faces.empty()) return {};
  constexpr std::size_t kChunk = 4096;
  const auto step = [&](FaceSteps& steps, std::size_t first, std::size_t chunkCount) {
    for (std::size_t n = first; n < first + chunkCount; ++n) {
      detail::Random random(seed, n);
      steps.add(stepAcross(field, faces[random.next() % faces.size()], random));
    }
  };
  return withThreads(threads, [&] {
    return detail::unorderedSumOfChunks<FaceSteps>(count, kChunk, progress, "querying both sides of faces", step);
  });
}

}  // namespace hpsdf
