#pragma once

#include "gl/gl_objects.h"
#include "hpsdf/field.h"
#include "view/surface_bounds.h"

namespace hpsdf::render {

/// A field on the device, in buffer textures: Mesa's llvmpipe allows 2^27 texels in these, but only 128 MiB in a
/// storage buffer. Floats in RGBA32UI texels are stored as their bits.
///
/// * nodes, RGBA32UI: x is the index of the first child, or for a leaf degree · 2^27 + index of its first coefficient;
///   y is the packed range of values (`packOutwards`), or the valueDeviation of a leaf; z is the gradientDeviation, w
///   the secondDerivative (`SurfaceBounds`).
/// * coefficients, R32F: the leaves' coefficients in the order of the nodes, padded for each leaf to a multiple of
///   four. Leaves up to degree 4 have the order of `LowDegree` in field.glsl.
/// * coefficientQuads, RGBA32F: the same buffer of coefficients, four per texel.
/// * linearParts, RGBA32F: `SurfaceBounds::linear` of each node.
/// * zones, RGBA32UI: x is `LookupGrid::blendExtents`; y, z and w are the members of `BlendZoneBounds`. Empty without
///   blending.
class FieldUpload {
 public:
  /// Throws `Error` if the field is too large for the device.
  FieldUpload(const Field& field, const std::vector<SurfaceBounds>& bounds, const std::vector<BlendZoneBounds>& zones);

  /// Binds the texture units 0 (nodes), 1 (coefficients), 4 (linearParts), 5 (coefficientQuads) and 6 (zones).
  void bind() const;

 private:
  GlBuffer nodeBuffer_, coefficientBuffer_, linearPartBuffer_, zoneBuffer_;
  GlBufferTexture nodes_, coefficients_, coefficientQuads_, linearParts_, zones_;
};

}  // namespace hpsdf::render
