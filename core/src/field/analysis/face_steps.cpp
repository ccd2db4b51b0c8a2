#include "hpsdf/detail/face_steps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "field/query/blend.h"
#include "field/query/evaluate.h"
#include "field/query/leaves.h"
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

/// A whole face of a leaf.
struct Face {
  int axis;                         ///< normal to the face
  int depth;                        ///< depth of the leaf
  std::array<double, 3> cellIndex;  ///< index of the leaf, and along `axis` of the leaf on the upper side of the face
};

/// All interfaces between leaves. Each is a whole face of the smaller leaf.
class Faces {
 public:
  Faces(const FieldData& field, const Progress& progress)
      : field_(field), leaves_(query::allLeaves(field)), ends_(leaves_.size()) {
    constexpr std::size_t kChunk = 1024;
    detail::forEachChunk(
        leaves_.size(), kChunk, progress, "counting faces", [&](std::size_t, std::size_t first, std::size_t count) {
          for (std::size_t n = first; n < first + count; ++n)
            query::forEachInterface(field_, leaves_[n], [&](int, int, const query::OctreeNode&) { ++ends_[n]; });
        });
    std::partial_sum(ends_.begin(), ends_.end(), ends_.begin());
  }

  std::size_t size() const { return ends_.empty() ? 0 : ends_.back(); }

  Face operator[](std::size_t number) const {
    const auto leaf = std::size_t(std::ranges::upper_bound(ends_, number) - ends_.begin());
    std::size_t left = number - (leaf == 0 ? 0 : ends_[leaf - 1]);
    Face face{};
    query::forEachInterface(field_, leaves_[leaf], [&](int axis, int step, const query::OctreeNode&) {
      if (left-- != 0) return;
      face = {.axis = axis, .depth = leaves_[leaf].depth, .cellIndex = {}};
      for (int a = 0; a < 3; ++a) face.cellIndex[a] = double(leaves_[leaf].cellIndex[a] + (a == axis && step > 0));
    });
    return face;
  }

 private:
  const FieldData& field_;
  std::vector<query::OctreeNode> leaves_;
  std::vector<std::size_t> ends_;  ///< for each leaf, the number of faces of it and of those before
};

/// Measures the jump of the field's value and gradient at a random point of a face.
FaceSteps stepAcross(const Field& field, const Face& face, detail::Random& random) {
  std::array<double, 3> above;
  for (int axis = 0; axis < 3; ++axis)
    above[axis] = std::ldexp(face.cellIndex[axis] + (axis == face.axis ? 0 : random.unit()), -face.depth);
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

FaceSteps stepsAcrossFaces(const Field& field, std::size_t count, std::uint64_t seed, int threads,
                           const Progress& progress) {
  return withThreads(threads, [&] {
    const Faces faces(field.data(), progress);
    if (faces.size() == 0) return FaceSteps{};
    constexpr std::size_t kChunk = 4096;
    const auto step = [&](FaceSteps& steps, std::size_t first, std::size_t chunkCount) {
      for (std::size_t n = first; n < first + chunkCount; ++n) {
        detail::Random random(seed, n);
        steps.add(stepAcross(field, faces[random.next() % faces.size()], random));
      }
    };
    return detail::unorderedSumOfChunks<FaceSteps>(count, kChunk, progress, "querying both sides of faces", step);
  });
}

}  // namespace hpsdf
