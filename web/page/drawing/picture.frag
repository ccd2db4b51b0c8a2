#version 300 es
// Colours the buffers of a view. Lights and ambient occlusion are those of the program (render/src/coloring/surface_shader.cpp).
precision highp float;
precision highp int;
precision highp usampler2D;
precision highp sampler2D;

uniform usampler2D integers;  // cell; degree, depth and crack, or degree; the rest as the passes write it
uniform sampler2D floats;     // normals of a surface
uniform usampler2D section;   // sections in the picture of a surface, as section.frag writes them
uniform bool hasSection;
uniform vec3 paper;           // the background, linear light
uniform sampler2D scale;      // 32 colours of levels in row 0, 256 of a continuous scale in row 1
uniform sampler2D ofCells;    // a number for each node
uniform bool isSlice;
uniform int mode;  // 0 plain, 1 degree, 2 depth, 3 distance, 4 number of the cell
uniform vec2 range;          // of the distance or of the logarithm of the number
uniform vec3 forward, right, up;
uniform bool parallel;
uniform float isoStep;  // between two lines of equal distance, 0 for none
uniform bool outlines;

out vec4 color;

const uint kNoCell = 0xffffffffu;
const vec3 kClay = vec3(0.6444797, 0.3185467, 0.1844750);
const int kRow = 2048;

vec3 toSrgb(vec3 linear) {
  vec3 x = clamp(linear, 0.0, 1.0);
  return mix(1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, 12.92 * x, lessThanEqual(x, vec3(0.0031308)));
}

// Pixels count from the top row down.
ivec2 size() { return textureSize(integers, 0); }
uvec4 at(ivec2 pixel) { return texelFetch(integers, pixel, 0); }
uvec4 onPlane(ivec2 pixel) {
  pixel = max(pixel, ivec2(0));
  return isSlice ? texelFetch(integers, pixel, 0) : texelFetch(section, pixel, 0);
}

uint depthOf(uvec4 texel) { return isSlice ? texel.z : texel.y >> 8 & 0xffu; }
uint degreeOf(uvec4 texel) { return texel.y & 0xffu; }
float valueOf(uvec4 texel) { return uintBitsToFloat(isSlice ? texel.w : texel.z); }

vec3 continuous(float t) { return texture(scale, vec2((clamp(t, 0.0, 1.0) * 255.0 + 0.5) / 256.0, 0.75)).rgb; }

vec3 colorOf(uvec4 texel) {
  if (mode == 1) return texelFetch(scale, ivec2(int(degreeOf(texel)), 0), 0).rgb;
  if (mode == 2) return texelFetch(scale, ivec2(int(depthOf(texel)), 0), 0).rgb;
  if (mode == 3) return continuous((valueOf(texel) - range.x) / (range.y - range.x));
  float number = texelFetch(ofCells, ivec2(int(texel.x) % kRow, int(texel.x) / kRow), 0).x;
  if (!(number > 0.0)) return vec3(0.3);  // the cell has none
  return continuous((log(number) - range.x) / (range.y - range.x));
}

// Position in the camera's frame: x right, y up, z towards the eye.
vec3 onPicture(ivec2 pixel, float z) {
  vec2 uv = (2.0 * vec2(pixel) + 1.0) / vec2(size()) - 1.0;
  return vec3(uv.x * length(right), -uv.y * length(up), z);
}
vec3 rayOf(ivec2 pixel) { return parallel ? vec3(0.0, 0.0, -1.0) : normalize(onPicture(pixel, -1.0)); }
vec3 positionOf(ivec2 pixel, float away) {
  return parallel ? onPicture(pixel, -away) : away * rayOf(pixel);
}

float openness(ivec2 pixel, vec3 position, vec3 normal) {
  const int kRings = 3, kTaps = 6;
  float viewHeight = parallel ? 2.0 * length(up) : 2.0 * length(up) * -position.z;
  float radius = 0.035 * viewHeight;
  float occluded = 0.0;
  for (int ring = 1; ring <= kRings; ++ring)
    for (int i = 0; i < kTaps; ++i) {
      float angle = 6.2831853 * (float(i) + float(ring) * 0.381966) / float(kTaps);
      float reach = 0.035 * float(size().y) * float(ring * ring) / float(kRings * kRings);
      ivec2 tap = pixel + ivec2(round(reach * vec2(cos(angle), sin(angle))));
      if (any(lessThan(tap, ivec2(0))) || any(greaterThanEqual(tap, size()))) continue;
      uvec4 texel = at(tap);
      if (texel.x == kNoCell) continue;
      vec3 towards = positionOf(tap, uintBitsToFloat(texel.w)) - position;
      float away = length(towards);
      if (away <= 0.0) continue;
      occluded += max(0.0, 1.0 - away / (3.0 * radius)) * max(0.0, dot(towards, normal) / away - 0.06);
    }
  return max(0.0, 1.0 - 2.6 * occluded / float(kRings * kTaps));
}

vec3 diffuse(vec3 n, float open) {
  const vec3 key = vec3(-0.5498, 0.6198, 0.5598), fill = vec3(0.8485, 0.0998, 0.5191), rim = vec3(0.3488, 0.5481, -0.7574);
  float wrapped = max(0.0, (dot(n, key) + 0.12) / 1.12);
  vec3 lamps = vec3(0.98, 0.91, 0.80) * wrapped + vec3(0.12, 0.16, 0.23) * max(0.0, dot(n, fill)) +
               vec3(0.26, 0.30, 0.36) * max(0.0, dot(n, rim));
  return lamps * (0.45 + 0.55 * open) + mix(vec3(0.10, 0.08, 0.07), vec3(0.26, 0.29, 0.34), 0.5 + 0.5 * n.y) * open;
}

vec3 gloss(vec3 n, vec3 toEye) {
  const vec3 key = vec3(-0.5498, 0.6198, 0.5598);
  float highlight = 0.13 * pow(max(0.0, dot(n, normalize(key + toEye))), 36.0);
  float facing = 1.0 - clamp(dot(n, toEye), 0.0, 1.0);
  return vec3(0.98, 0.91, 0.80) * highlight + vec3(0.26, 0.29, 0.34) * 0.12 * facing * facing * facing * facing;
}

vec3 shaded(ivec2 pixel, uvec4 texel) {
  vec3 toEye = -rayOf(pixel);
  vec3 world = texelFetch(floats, pixel, 0).xyz;
  vec3 n = vec3(dot(world, normalize(right)), dot(world, normalize(up)), -dot(world, normalize(forward)));
  float facing = dot(n, toEye);
  if (facing < 0.0) n = normalize(n - facing * toEye);
  float open = openness(pixel, positionOf(pixel, uintBitsToFloat(texel.w)), n);
  if (mode == 0) return kClay * diffuse(n, open) + open * gloss(n, toEye);
  const vec3 key = vec3(-0.5498, 0.6198, 0.5598);
  float light = 0.50 + 0.58 * max(0.0, (dot(n, key) + 0.5) / 1.5) - 0.10 * (1.0 - n.z);
  return colorOf(texel) * light * (0.35 + 0.65 * open) + 0.4 * open * dot(gloss(n, toEye), vec3(1.0 / 3.0));
}

// A plane that is cut by the field, with the outlines of the cells, lines of equal distance and the surface.
vec3 sliced(ivec2 pixel, uvec4 texel) {
  vec3 c = mode == 0 ? (valueOf(texel) < 0.0 ? vec3(0.855, 0.730, 0.609) : vec3(0.730, 0.776, 0.831)) : colorOf(texel);
  uvec4 before = onPlane(pixel - ivec2(1, 0)), above = onPlane(pixel - ivec2(0, 1));
  if (outlines && (before.x != texel.x || above.x != texel.x)) c = mix(c, vec3(0.0060, 0.0052, 0.0194), 0.62);
  float value = valueOf(texel);
  if (isoStep > 0.0 && (floor(value / isoStep) != floor(valueOf(before) / isoStep) || floor(value / isoStep) != floor(valueOf(above) / isoStep)))
    c = mix(c, vec3(0.0091, 0.0116, 0.0252), 0.42);
  if (before.x != kNoCell && above.x != kNoCell && ((value < 0.0) != (valueOf(before) < 0.0) || (value < 0.0) != (valueOf(above) < 0.0)))
    c = mode == 3 ? vec3(0.003) : vec3(1.0);
  return c;
}

// Returns true where a section hides the surface: a cut does so always, because rays start behind it.
bool isSectioned(uvec4 cut, uvec4 texel) {
  if (!hasSection || cut.x == kNoCell) return false;
  return texel.x == kNoCell || cut.y >> 24 == 1u || uintBitsToFloat(cut.w) < uintBitsToFloat(texel.w);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  uvec4 texel = at(pixel);
  uvec4 cut = onPlane(pixel);
  color = vec4(toSrgb(paper), 1.0);
  if (isSlice) {
    if (texel.x != kNoCell) color.rgb = toSrgb(sliced(pixel, texel));
  } else if (isSectioned(cut, texel)) {
    color.rgb = toSrgb(sliced(pixel, cut));
  } else if (texel.x != kNoCell) {
    color.rgb = toSrgb(shaded(pixel, texel));
  }
}
