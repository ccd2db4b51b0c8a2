#pragma once

#include <vector>

#include "hpsdf/field.h"

namespace hpsdf::render {

/// What is certain about a leaf of a blended field beside the `NodeBounds` of its polynomial. The field is
/// F = f + Σ wₙ dₙ / Σ wₙ there, f the leaf's polynomial, dₙ what those of the leaves that reach into it differ by.
struct ZoneBounds {
  float apart = 0;  ///< |F − f| is at most this, throughout the leaf, where others reach into it |dₙ| too
  float twist = 0;  ///< |∇dₙ| is at most this there, in local coordinates
  /// The shortest reach of any weight there, from half of its own to none, in local coordinates. Over a step of a
  /// quarter of it F sags below its chord by a few hundredths of what the dₙ differ by, at most.
  float reach = 0;
};

/// One for every node, none for a field without blending. A little wider than certain, by what single precision may
/// add.
std::vector<ZoneBounds> zoneBounds(const Field& field);

}  // namespace hpsdf::render
