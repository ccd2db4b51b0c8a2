// A field without blending: its leaves answer alone. As leaves_blended.glsl.

float fieldValue(Node leaf, uint depth, uvec3 place, vec3 local) {
  return evaluate(leaf.offset, leaf.degree, local);
}

vec4 fieldWithGradient(Node leaf, uint depth, uvec3 place, vec3 local) {
  return evaluateWithGradient(leaf.offset, leaf.degree, local);
}

Node boundsNear(Node leaf, vec3 fraction) { return leaf; }

vec3 aheadNear(vec3 fraction, bvec3 forwards) { return mix(fraction, 1.0 - fraction, forwards); }
