// Draws one point for each block of 8 x 8 pixels whose rays may hit the surface. The page draws blocks where the view has
// them. Elsewhere they are packed into the render target in rows, so that little beside them is read back.

#ifdef HPSDF_WEB
layout(location = 1) uniform ivec2 firstPixel;
#else
layout(location = 1) uniform int firstBlock;  // the block at the upper left of the render target
layout(location = 1) in uvec2 chosenPixels;   // Block::chosen

flat out ivec2 toView;
flat out uvec2 chosen;
#endif
layout(location = 13) uniform ivec2 viewport;

layout(location = 0) in vec3 block;  // x, y: upper left pixel of the block; z: distance at which its rays start

flat out float start;

const float kBlock = 8.0;  // pixels along each side of a block; same value as in surface_blocks.h

void main() {
#ifdef HPSDF_WEB
  vec2 corner = block.xy - vec2(firstPixel);
#else
  int number = gl_VertexID - firstBlock;
  int columns = viewport.x / int(kBlock);
  vec2 corner = kBlock * vec2(number % columns, number / columns);
  toView = ivec2(block.xy) - ivec2(corner);
  chosen = chosenPixels;
#endif
  vec2 center = corner + 0.5 * kBlock;
  gl_Position = vec4(2.0 * center / vec2(viewport) - 1.0, 0.0, 1.0);
  gl_PointSize = kBlock;
  start = block.z;
}
