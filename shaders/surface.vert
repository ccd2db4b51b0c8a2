// Draws one point for each block of 8 x 8 pixels whose rays may hit the surface.

layout(location = 1) uniform ivec2 firstPixel;
layout(location = 13) uniform ivec2 viewport;

layout(location = 0) in vec3 block;  // x, y: upper left pixel of the block; z: distance at which its rays start

flat out float start;

const float kBlock = 8.0;  // pixels along each side of a block; same value as in surface_blocks.h

void main() {
  vec2 center = block.xy + 0.5 * kBlock - vec2(firstPixel);
  gl_Position = vec4(2.0 * center / vec2(viewport) - 1.0, 0.0, 1.0);
  gl_PointSize = kBlock;
  start = block.z;
}
