// Samples the field at one point of a slice for each pixel. Positions are computed in double precision and rounded as
// on the CPU, so that CPU and GPU find the same cells. WebGL has no double precision: there positions are numbers of 32
// bits before and 32 bits behind the point, the sum of a vector for each column and one for each row of pixels.

layout(location = 0) out uvec4 cellDegreeDepthValue;

#ifdef HPSDF_WEB

uniform isampler2D wholes;     // whole parts of the vectors; columns of pixels in row 0, rows of pixels in row 1
uniform usampler2D fractions;  // their fractions, in units of 2^-32

// A position within a base cell, as a fraction of its edges.
#define Fraction uvec3

// Returns false outside of the domain.
bool locate(out uvec3 base, out Fraction fraction) {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  uvec3 ofColumn = texelFetch(fractions, ivec2(pixel.x, 0), 0).xyz;
  fraction = ofColumn + texelFetch(fractions, ivec2(pixel.y, 1), 0).xyz;
  ivec3 whole = texelFetch(wholes, ivec2(pixel.x, 0), 0).xyz + texelFetch(wholes, ivec2(pixel.y, 1), 0).xyz +
                ivec3(lessThan(fraction, ofColumn));
  // The domain's upper faces belong to the last cells.
  for (int axis = 0; axis < 3; ++axis)
    if (whole[axis] == int(grid[axis]) && fraction[axis] == 0u) {
      whole[axis] -= 1;
      fraction[axis] = 0xffffffffu;
    }
  base = uvec3(whole);
  return !any(lessThan(whole, ivec3(0))) && !any(greaterThanEqual(whole, ivec3(grid)));
}

// Doubles a fraction and returns its whole parts, 0 or 1.
uvec3 doubleFraction(inout Fraction fraction) {
  uvec3 upper = fraction >> 31;
  fraction <<= 1;
  return upper;
}

vec3 localOf(Fraction fraction) { return vec3(fraction) * exp2(-31.0) - 1.0; }

#else

layout(location = 1) uniform ivec2 firstPixel;
layout(location = 2) uniform ivec2 size;
layout(location = 3) uniform dvec3 origin;
layout(location = 4) uniform dvec3 right;
layout(location = 5) uniform dvec3 up;
layout(location = 6) uniform dvec2 pixelStep;

#define Fraction dvec3

bool locate(out uvec3 base, out Fraction fraction) {
  ivec2 pixel = firstPixel + ivec2(gl_FragCoord.xy);
  precise dvec3 p = (origin + right * (double(2 * pixel.x + 1 - size.x) * pixelStep.x)) +
                    up * (double(size.y - 2 * pixel.y - 1) * pixelStep.y);
  base = min(uvec3(p), grid - 1u);
  precise dvec3 inBase = p - dvec3(base);
  fraction = inBase;
  return !any(lessThan(p, dvec3(0.0))) && !any(greaterThan(p, dvec3(grid)));
}

uvec3 doubleFraction(inout Fraction fraction) {
  precise dvec3 doubled = 2.0lf * fraction;
  uvec3 upper = uvec3(greaterThanEqual(doubled, dvec3(1.0)));
  fraction = doubled - dvec3(upper);
  return upper;
}

vec3 localOf(Fraction fraction) { return vec3(2.0lf * fraction - 1.0lf); }

#endif

void main() {
  cellDegreeDepthValue = uvec4(kNoCell, 0u, 0u, 0u);
  uvec3 base;
  Fraction fraction;
  if (!locate(base, fraction)) return;
  Node node = fetchNode(baseCellIndex(base));
  uint depth = 0u;
  uvec3 cellIndex = base;
  while (!node.leaf) {
    uvec3 upper = doubleFraction(fraction);
    cellIndex = 2u * cellIndex + upper;
    node = fetchNode(childIndex(node, upper));
    ++depth;
  }
  float value = fieldValue(node, depth, cellIndex, localOf(fraction));
  cellDegreeDepthValue = uvec4(node.index, uint(node.degree), depth, floatBitsToUint(value));
}
