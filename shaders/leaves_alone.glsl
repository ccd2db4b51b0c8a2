// A field without blending: its leaves answer alone. As leaves_blended.glsl.

float fieldValue(Node leaf, uint depth, uvec3 place, vec3 local) {
  return evaluate(leaf.offset, leaf.degree, local);
}

vec4 fieldWithGradient(Node leaf, uint depth, uvec3 place, vec3 local) {
  return evaluateWithGradient(leaf.offset, leaf.degree, local);
}

const bool kBlended = false;

Blending blendingAt(uint leaf, vec3 fraction) { return Blending(false, 0.0, 0.0, 0.0, 0.0); }

Answer fieldAmong(Node leaf, uint depth, uvec3 place, vec3 local, float margin) { return Answer(0.0, 0.0, 0.0); }
