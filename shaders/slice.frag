// Samples the field at one point of a slice for each pixel. Positions are computed in double precision and rounded as
// on the CPU, so that CPU and GPU find the same cells.

layout(location = 1) uniform ivec2 firstPixel;
layout(location = 2) uniform ivec2 size;
layout(location = 3) uniform dvec3 origin;
layout(location = 4) uniform dvec3 right;
layout(location = 5) uniform dvec3 up;
layout(location = 6) uniform dvec2 pixelStep;

layout(location = 0) out uvec4 cellDegreeDepthValue;

void main() {
  ivec2 pixel = firstPixel + ivec2(gl_FragCoord.xy);
  precise dvec3 p = (origin + right * (double(2 * pixel.x + 1 - size.x) * pixelStep.x)) +
                    up * (double(size.y - 2 * pixel.y - 1) * pixelStep.y);
  cellDegreeDepthValue = uvec4(kNoCell, 0u, 0u, 0u);
  if (any(lessThan(p, dvec3(0.0))) || any(greaterThan(p, dvec3(grid)))) return;

  uvec3 base = min(uvec3(p), grid - 1u);
  precise dvec3 fraction = p - dvec3(base);
  Node node = fetchNode(baseCellIndex(base));
  uint depth = 0u;
  uvec3 cellIndex = base;
  while (!node.leaf) {
    precise dvec3 doubled = 2.0lf * fraction;
    uvec3 upper = uvec3(greaterThanEqual(doubled, dvec3(1.0)));
    fraction = doubled - dvec3(upper);
    cellIndex = 2u * cellIndex + upper;
    node = fetchNode(childIndex(node, upper));
    ++depth;
  }
  float value = fieldValue(node, depth, cellIndex, vec3(2.0lf * fraction - 1.0lf));
  cellDegreeDepthValue = uvec4(node.index, uint(node.degree), depth, floatBitsToUint(value));
}
