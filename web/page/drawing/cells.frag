#version 300 es
// Colours the edges of cells that nothing hides. Edges fade where their cells are small in the picture.
precision highp float;
precision highp int;
precision highp usampler2D;

uniform usampler2D integers;  // the hits of the picture, with their distances from the eye
uniform usampler2D section;
uniform bool hasSection;
uniform float scaleOfBuffers;  // pixels of the buffers for each pixel of the canvas
uniform vec3 shownLo, shownHi;
uniform vec3 ink;

in vec3 fromEye;
in vec3 position;
in float pixels;
out vec4 color;

float hiddenFrom(uvec4 texel) { return texel.x == 0xffffffffu ? 1e30 : uintBitsToFloat(texel.w); }

void main() {
  ivec2 size = textureSize(integers, 0);
  ivec2 pixel = min(ivec2(gl_FragCoord.xy * scaleOfBuffers), size - 1);
  pixel.y = size.y - 1 - pixel.y;
  float hidden = hiddenFrom(texelFetch(integers, pixel, 0));
  if (hasSection) hidden = min(hidden, hiddenFrom(texelFetch(section, pixel, 0)));
  bool isCutAway = any(lessThan(position, shownLo)) || any(greaterThan(position, shownHi));
  if (isCutAway || length(fromEye) > hidden * 1.0005) discard;
  color = vec4(ink, clamp(pixels / 30.0, 0.0, 0.75));
}
