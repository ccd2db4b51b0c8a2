#pragma once

#include "gl/gl_objects.h"
#include "hpsdf/field.h"
#include "view/surface_bounds.h"

namespace hpsdf::render {

/// A field on the device, as buffer textures: Mesa's llvmpipe allows them 2^27 texels, a storage buffer only 128 MiB.
///
/// * nodes, RGBA32UI: x is the first child, or degree · 2^27 + index of the leaf's first coefficient.
///   y is `packOutwards` of the range, or the valueDeviation of a leaf.
///   z is the gradientDeviation, w the secondDerivative.
/// * coefficients, R32F: those of the leaves in the order of the nodes, each leaf padded to a multiple of four.
///   Leaves up to degree 4 have the order of `LowDegree` in field.glsl.
/// * coefficientQuads, RGBA32F: the buffer of the coefficients, four to a texel.
/// * linearParts, RGBA32F: `SurfaceBounds::linear`.
/// * zones, RGBA32UI: x is `LookupGrid::blendExtents`; y, z and w are the numbers of `BlendZoneBounds`.
///   Empty without blending.
///
/// RGBA32UI texels hold floats by their bits.
class FieldUpload {
 public:
  /// Throws `Error` when the field exceeds what the device holds.
  FieldUpload(const Field& field, const std::vector<SurfaceBounds>& bounds, const std::vector<BlendZoneBounds>& zones);

  /// Binds the texture units 0 (nodes), 1 (coefficients), 4 (linearParts), 5 (coefficientQuads) and 6 (zones).
  void bind() const;

 private:
  GlBuffer nodeBuffer_, coefficientBuffer_, linearPartBuffer_, zoneBuffer_;
  GlBufferTexture nodes_, coefficients_, coefficientQuads_, linearParts_, zones_;
};

}  // namespace hpsdf::render
