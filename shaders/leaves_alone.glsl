// The functions of leaves_blended.glsl for a field without blending: within a leaf, the field is the leaf's function.

const bool kBlended = false;

float fieldValue(Node leaf, uint depth, uvec3 cellIndex, vec3 local) {
  return leafValue(leaf, depth, cellIndex, local);
}

vec4 fieldWithGradient(Node leaf, uint depth, uvec3 cellIndex, vec3 local) {
  return leafWithGradient(leaf, depth, cellIndex, local);
}

BlendZone blendZoneAt(uint leaf, vec3 fraction) { return BlendZone(false, 0.0, 0.0, 0.0, 0.0); }

FieldRange blendedRange(Node leaf, uint depth, uvec3 cellIndex, vec3 local, float margin) {
  return FieldRange(0.0, 0.0, 0.0);
}
