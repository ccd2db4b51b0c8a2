#pragma once
// Projection onto polynomials from values and gradients of a function at few points.

#include <memory>

#include "basis/projection.h"

namespace hpsdf::basis {

/// Returns an object that estimates the L2 projection onto polynomials of total degree `degree`, 3 to 6, from values
/// and gradients at 14, 34, 34 or 58 points within the cell. The points have the symmetry of the cube. Returns nullptr
/// for other degrees.
///
/// The projection reproduces polynomials up to total degree `degree` − 1. Among all estimates that do so and are linear
/// in the samples, it has the least expected squared error for functions with kinks along random planes, such as the
/// distance to a mesh. The covariance of such functions is |x − y|³, up to polynomials of degree 1, whatever the size
/// of the cell: a kink is the function |t| of the distance t from its plane, and the mean of |n·(x − y)|³ over all
/// directions n is proportional to |x − y|³.
///
/// The mean square that the object computes is that of its polynomial plus an estimate of the mean squared error, which
/// follows from the part of the samples that no polynomial explains.
std::unique_ptr<const Projection> gradientProjection(int degree);

}  // namespace hpsdf::basis
