#pragma once

#include <array>
#include <vector>

#include "hpsdf/field.h"

namespace hpsdf::render {

/// What is certain about a leaf of a blended field beside the `NodeBounds` of its polynomial. The field is
/// F = f + Σ wₙ dₙ / Σ wₙ there, f the leaf's polynomial, dₙ what those of the leaves that reach into it differ by.
struct ZoneBounds {
  float apart = 0;  ///< |F − f| is at most this, throughout the leaf
  /// Where the point is near a face along one, two or three axes: the gradient of F − f in local coordinates is at most
  /// so long, and no second derivative of it, along any unit vector, is larger.
  std::array<float, 3> bend = {}, curve = {};
};

/// One for every node, none for a field without blending. A little wider than certain, by what single precision may
/// add.
std::vector<ZoneBounds> zoneBounds(const Field& field);

}  // namespace hpsdf::render
