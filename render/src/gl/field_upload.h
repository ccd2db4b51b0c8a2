#pragma once

#include "gl/gl_objects.h"
#include "hpsdf/field.h"
#include "view/surface_bounds.h"

namespace hpsdf::render {

/// A field on the device, in buffer textures. Storage buffers would be too small: Mesa's llvmpipe limits them to
/// 128 MiB, but allows 2^27 texels in a buffer texture. RGBA32UI texels hold floats as their bits. The textures are:
///
/// * nodes, RGBA32UI. In a leaf, x is degree · 2^27 + index of the first coefficient, and y is the valueDeviation. In
///   an internal node, x is the index of the first child, and y is the packed range of values (`packOutwards`). In any
///   node, z is the gradientDeviation, and w is the secondDerivative (`SurfaceBounds`).
///   In an exact leaf, x is 31 · 2^27 + offset of its runs, and the two lowest bits of w are its `ExactSign`.
/// * coefficients, R32F: the leaves' coefficients in the order of the nodes, padded for each leaf to a multiple of
///   four. Leaves up to degree 4 have the order of `LowDegree` in field.glsl.
/// * coefficientQuads, RGBA32F: the same buffer of coefficients, four per texel.
/// * linearParts, RGBA32F: `SurfaceBounds::linear` of each node.
/// * zones, RGBA32UI: x is `LookupGrid::blendExtents`; y, z and w are the members of `BlendZoneBounds`. This texture is
///   empty for a field without blending.
/// * exactLists, R32UI: `ExactTriangles::lists`.
/// * exactCorners, RGBA32F: three texels for each triangle of exact leaves. x, y and z are a corner, from the domain's
///   lower corner. The components w are the triangle's unit normal.
class FieldUpload {
 public:
  /// Throws `Error` if the field is too large for the device.
  FieldUpload(const Field& field, const std::vector<SurfaceBounds>& bounds, const std::vector<BlendZoneBounds>& zones);

  /// Binds the texture units 0 (nodes), 1 (coefficients), 4 (linearParts), 5 (coefficientQuads), 6 (zones),
  /// 7 (exactLists) and 8 (exactCorners).
  void bind() const;

 private:
  void uploadExact(const FieldData& field, GLint largest);

  GlBuffer nodeBuffer_, coefficientBuffer_, linearPartBuffer_, zoneBuffer_, exactListBuffer_, exactCornerBuffer_;
  GlBufferTexture nodes_, coefficients_, coefficientQuads_, linearParts_, zones_, exactLists_, exactCorners_;
};

}  // namespace hpsdf::render
