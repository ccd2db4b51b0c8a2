// Second pass of a surface: from the bracket of the first crossing to the hit itself, the ray's positions in double
// precision. A pixel still under way counts as a miss.

layout(location = 11) uniform int mostRefinements;

layout(location = 0) out uvec4 cellLevelsValueDistance;  // degree | depth << 8 | crack << 16; value, distance as floats' bits
layout(location = 1) out vec4 normal;

const float kTurned = 1e-4;     // radians, about: how far the gradient may have turned since where it was taken
const float kInfinity = 1e30;
const float kConverged = 1e-8;  // in domain diagonals: change of the root between two steps; as in trace.cpp
const float kCrack = 4e-6;      // in domain diagonals at slope 1: the lowest step at a face that counts; as in trace.h

vec3 localAt(CellPoint cell, Ray ray, double t) {
  dvec3 inBase = ray.origin - dvec3(cell.base) + t * ray.direction;
  return vec3(2.0lf * (inBase * double(cell.scale) - dvec3(cell.path)) - 1.0lf);
}

void main() {
  uvec4 integers = texelFetch(stateIntegers, ivec2(gl_FragCoord.xy), 0);
  cellLevelsValueDistance = uvec4(kNoCell, integers.x, 0u, 0u);
  normal = vec4(0.0);
  if (integers.x < kOnFace) return;
  vec4 bracket = texelFetch(stateFloats, ivec2(gl_FragCoord.xy), 0);
  bool bracketed = integers.x == kBracketed;
  float t = uintBitsToFloat(integers.y);
  float side = uintBitsToFloat(integers.z);

  Ray ray = pixelRay();
  // the march stood in this leaf, and finds it again from the same point
  CellPoint at = baseCellAt(vec3(ray.origin) + t * vec3(ray.direction));
  while (!at.node.leaf) descend(at);
  uvec3 place = placeOf(at);

  // Newton's method from `first`, in double precision, by what is to be added, in single precision; halving where it
  // would leave the bracket
  double first = double(bracketed ? bracket.z : t);
  vec3 local = localAt(at, ray, first);
  vec3 localDirection = 2.0 * at.scale * vec3(ray.direction);
  bool near = blendingAt(at.node.index, at.fraction).near;
  float curve = near ? kInfinity : at.node.curve * dot(localDirection, localDirection);
  float a = bracket.x - bracket.z, b = bracket.y - bracket.z;
  float added = 0.0, change = 0.0;
  vec4 gradientValue;
  for (int i = 0; i < mostRefinements; ++i) {
    added += change;
    gradientValue = fieldWithGradient(at.node, at.depth, place, local + added * localDirection);
    float height = side * (gradientValue.w - offset);
    float slope = side * dot(gradientValue.xyz, localDirection);
    if (!bracketed) break;
    if (height > 0.0) {
      a = added;
    } else {
      b = added;
    }
    change = -height / slope;
    bool newton = added + change >= a && added + change <= b;
    if (!newton) change = 0.5 * (a + b) - added;
    // what is left is curve / slope * change^2 / 2 at most
    float turned = newton ? abs(curve / slope * change) : kInfinity;
    bool close = turned <= kTurned && turned * abs(change) <= 2.0 * kConverged * diagonal;
    if (close || abs(change) <= kConverged * diagonal) break;
  }
  added += change;
  gradientValue.w += change * dot(gradientValue.xyz, localDirection);
  vec3 gradient = gradientValue.xyz * vec3(scale);
  float steepness = length(gradient);
  // a cell of degree 0 has no gradient: face the eye
  normal.xyz = steepness > 0.0 ? gradient / steepness : -vec3(ray.worldDirection);
  bool crack = !bracketed && abs(gradientValue.w - offset) > kCrack * diagonal * max(1.0, steepness);
  cellLevelsValueDistance =
      uvec4(at.node.index, uint(at.node.degree) | at.depth << 8 | uint(crack) << 16, floatBitsToUint(gradientValue.w),
            floatBitsToUint(float(ray.fromEye + first + double(added))));
}
