#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hpsdf/field.h"
#include "view/blend_zone_bounds.h"

namespace hpsdf::render {

/// What is certain about the field within a node, from its coefficients alone (|L_i| ≤ 1, |L_i'| ≤ i(i+1)/2,
/// |L_i''| ≤ (i−1)i(i+1)(i+2)/8): it lets a ray pass a node without evaluating it, and step within a leaf without ever
/// passing a zero.
struct NodeBounds {
  float
      lo;  ///< the field's values within the node lie in [lo, hi], blended or not; all else is of the polynomial alone
  float hi;
  /// Leaves: the gradient in local coordinates differs from that of the polynomial's linear part by at most this.
  /// Internal nodes: −1.
  float bend;
  float rest;   ///< leaves: the value differs from the linear part's by at most this
  float curve;  ///< leaves: no second derivative in local coordinates, along any unit vector, is larger than this
  /// Leaves: the linear part, c_100, c_010, c_001 and c_000.
  std::array<float, 4> linear;
};

/// One for every node. A little wider than the coefficients say, by what single precision may add.
/// `zones` are those of a blended field.
std::vector<NodeBounds> nodeBounds(const FieldData& field, const std::vector<ZoneBounds>& zones = {});

/// The range [lo, hi] in 32 bits: the upper halves of the two floats, hi's in the high bits, lo rounded down and hi up.
std::uint32_t packOutwards(float lo, float hi);

}  // namespace hpsdf::render
