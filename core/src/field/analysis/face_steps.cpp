#include "hpsdf/detail/face_steps.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "field/query/blend.h"
#include "field/query/evaluate.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "util/chunks.h"
#include "util/random_points.h"

namespace hpsdf {
namespace {

/// What a query answers at a point of the domain in grid coordinates, in which faces lie exactly on numbers.
ValueAndGradient answerAt(const Field& field, const std::array<double, 3>& coordinates) {
  const LookupGrid& lookupGrid = field.lookupGrid();
  GridPoint at{coordinates, {}, 0};
  for (int axis = 0; axis < 3; ++axis) {
    at.fixed[axis] = std::min(static_cast<std::int64_t>(coordinates[axis] * (std::int64_t{1} << kMaxDepth)),
                              lookupGrid.frame.last[axis]);
    at.path |= pathAlong(axis, at.fixed[axis]);
  }
  return answerWithin<ValueAndGradient>(field.data(), lookupGrid, coordinates, find(field.data(), lookupGrid, at));
}

/// The step at a random point of a face.
FaceSteps stepAcross(const Field& field, const Interface& face, Random& random) {
  const GridFrame& frame = field.lookupGrid().frame;
  const int depth = std::max(face.depths[0], face.depths[1]);  // of the smaller leaf, whose whole face it is
  std::array<double, 3> above;
  for (int axis = 0; axis < 3; ++axis) {
    const double center =
        std::ldexp((face.center[axis] - frame.lower[axis]) / frame.size[axis] * frame.cells[axis], depth);
    above[axis] = std::ldexp(axis == face.axis ? std::round(center) : std::floor(center) + random.unit(), -depth);
  }
  std::array<double, 3> below = above;
  below[face.axis] = std::nextafter(above[face.axis], 0.0);  // cells are half-open: this one lies in the other
  const ValueAndGradient one = answerAt(field, below), other = answerAt(field, above);
  return {1, std::abs(other.value - one.value), (other.gradient - one.gradient).norm()};
}

void takeIn(FaceSteps& all, const FaceSteps& more) {
  all.points += more.points;
  all.value = std::max(all.value, more.value);
  all.gradient = std::max(all.gradient, more.gradient);
}

}  // namespace

FaceSteps stepsAcrossFaces(const Field& field, std::span<const Interface> faces, std::size_t count, std::uint64_t seed,
                           int threads, const Progress& progress) {
  FaceSteps all;
  if (faces.empty()) return all;
  constexpr std::size_t kChunk = 4096;
  std::mutex adding;
  withThreads(threads, [&] {
    const auto step = [&](std::size_t, std::size_t first, std::size_t ofChunk) {
      FaceSteps part;
      for (std::size_t n = first; n < first + ofChunk; ++n) {
        Random random(seed, n);
        takeIn(part, stepAcross(field, faces[random.next() % faces.size()], random));
      }
      const std::lock_guard lock(adding);
      takeIn(all, part);
    };
    forEachChunk(count, kChunk, progress, "asking on both sides of faces", step);
  });
  return all;
}

}  // namespace hpsdf
