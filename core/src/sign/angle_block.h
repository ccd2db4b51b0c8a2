#pragma once
// The solid angles of four triangles at a time.

#include "bvh/triangle_tree.h"
#include "sign/solid_angle.h"

namespace hpsdf::sign {

/// The corners of up to four triangles. Unused places hold triangles without area.
struct alignas(32) AngleBlock {
  double corner[3][3][bvh::kWidth] = {};  ///< coordinate `axis` of corner k of triangle i: corner[k][axis][i]
};

/// Sums of solid angles, one for each place of a block.
struct alignas(32) BlockAngles {
  double real[bvh::kWidth] = {1, 1, 1, 1};
  double imaginary[bvh::kWidth] = {};
  double turns[bvh::kWidth] = {};

  /// Returns the sum over all places, in radians.
  double value() const {
    double sum = 0;
    for (int i = 0; i < bvh::kWidth; ++i) sum += AngleSum(real[i], imaginary[i], turns[i]).value();
    return sum;
  }
};

/// Adds half of the solid angles of a block's triangles, seen from x. The results are the same to the bit as those of
/// `addHalfSolidAngle` in each place, on every instruction set.
void addHalfSolidAngles(const AngleBlock& block, const Vector3& x, BlockAngles& sum);

}  // namespace hpsdf::sign
