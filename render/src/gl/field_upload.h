#pragma once

#include "gl/gl_objects.h"
#include "hpsdf/field.h"
#include "view/surface_bounds.h"

namespace hpsdf::render {

/// A field on the device, as buffer textures: Mesa's llvmpipe allows them 2^27 texels, a storage buffer only 128 MiB.
///
/// nodes, RGBA32UI: x = first child, or degree·2^27 + index of the leaf's first coefficient; the rest are `NodeBounds`:
/// y = upper halves of the floats hi (high) and lo (low), rounded outwards, or, of a leaf, the bits of rest; z = bend
/// and w = curve, as bits of floats.
/// coefficients, R32F: as in FieldData, but those of leaves up to degree 4 in the order of field.glsl's straight code,
/// and all leaves padded to a multiple of four; coefficientQuads: the same by four, RGBA32F.
/// linearParts, RGBA32F: `NodeBounds::linear`.
/// zones, RGBA32UI, none without blending: `LookupGrid::reaches`, and `ZoneBounds` by the floats' bits.
class FieldUpload {
 public:
  /// Throws `Error` when the field exceeds what the device holds.
  FieldUpload(const Field& field, const std::vector<NodeBounds>& bounds, const std::vector<ZoneBounds>& zones);

  /// To texture units 0 (nodes), 1 (coefficients), 4 (linear parts), 5 (coefficients by four) and 6 (zones).
  void bind() const;

 private:
  GlBuffer nodeBuffer_, coefficientBuffer_, linearPartBuffer_, zoneBuffer_;
  GlBufferTexture nodes_, coefficients_, coefficientQuads_, linearParts_, zones_;
};

}  // namespace hpsdf::render
