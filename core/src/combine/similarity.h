#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf::combine {

/// A rotation, a uniform scale and a translation: y = scale · rotation · x + translation.
struct Similarity {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  double scale = 1;
  Vector3 translation = Vector3::Zero();

  Vector3 operator()(const Vector3& x) const { return scale * (rotation * x) + translation; }
  Vector3 inverse(const Vector3& y) const { return rotation.transpose() * ((y - translation) / scale); }
};

/// Returns the similarity that applies `inner` first, then `outer`.
Similarity after(const Similarity& outer, const Similarity& inner);

/// Return the similarity of an operation of expressions with these numbers.
Similarity moveBy(const std::vector<double>& numbers);
Similarity rotateBy(const std::vector<double>& numbers);  ///< quarter turns about coordinate axes are exact
Similarity scaleBy(const std::vector<double>& numbers);

TriangleMesh transformed(const TriangleMesh& mesh, const Similarity& by);

/// Returns the smallest box around the transformed box; an empty one for an empty box.
Box transformed(const Box& box, const Similarity& by);

/// A solid whose size is less than this share of its greatest coordinate counts as spoiled by rounding: coordinates are
/// spaced by more than 2e-7 of its size.
constexpr double kLeastShareOfCoordinates = 0x1p-30;

/// Throws `Error` if a solid with this box would be spoiled by rounding, or beyond `kLargestCoordinate`, where the
/// similarity places it. A solid that is spoiled without it is not refused.
void requireUsable(const Similarity& placement, const Box& box);

}  // namespace hpsdf::combine
