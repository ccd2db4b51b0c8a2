// Second pass of a surface: from the bracket of the first crossing to the hit itself, the ray's positions in double
// precision. A pixel still under way counts as a miss.

layout(location = 11) uniform int mostRefinements;

layout(location = 0) out uvec4 cellLevelsValueDistance;  // degree | depth << 8; value and distance as bits of floats
layout(location = 1) out vec4 normal;

const float kTurned = 1e-4;     // radians, about: how far the gradient may have turned since where it was taken
const float kInfinity = 1e30;
const float kConverged = 1e-8;  // in domain diagonals: change of the root between two steps; as in trace.cpp

vec3 localAt(CellPoint cell, Ray ray, double t) {
  dvec3 inBase = ray.origin - dvec3(cell.base) + t * ray.direction;
  return vec3(2.0lf * (inBase * double(cell.scale) - dvec3(cell.path)) - 1.0lf);
}

// L_i' to L_{i+1}', where `value` is L_i.
void advanceDerivative(inout float derivative, inout float before, float value, int i) {
  float next = before + float(2 * i + 1) * value;
  before = derivative;
  derivative = next;
}

// Gradient with respect to local coordinates, and value.
vec4 evaluateWithGradient(int index, int degree, vec3 local) {
  float value = 0.0;
  vec3 gradient = vec3(0.0);
  float x = 1.0, xBefore = 0.0, dx = 0.0, dxBefore = 0.0;
  for (int i = 0; i <= degree; ++i) {
    float y = 1.0, yBefore = 0.0, dy = 0.0, dyBefore = 0.0;
    for (int j = 0; j <= degree - i; ++j) {
      float line = 0.0, lineDz = 0.0;
      float z = 1.0, zBefore = 0.0, dz = 0.0, dzBefore = 0.0;
      for (int k = 0; k <= degree - i - j; ++k) {
        float c = texelFetch(coefficients, index++).x;
        line += c * z;
        lineDz += c * dz;
        advanceDerivative(dz, dzBefore, z, k);
        advance(z, zBefore, local.z, float(k));
      }
      value += line * y * x;
      gradient += vec3(line * y * dx, line * dy * x, lineDz * y * x);
      advanceDerivative(dy, dyBefore, y, j);
      advance(y, yBefore, local.y, float(j));
    }
    advanceDerivative(dx, dxBefore, x, i);
    advance(x, xBefore, local.x, float(i));
  }
  return vec4(gradient, value);
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

  // Newton's method from `first`, in double precision, by what is to be added, in single precision; halving where it
  // would leave the bracket
  double first = double(bracketed ? bracket.z : t);
  vec3 local = localAt(at, ray, first);
  vec3 localDirection = 2.0 * at.scale * vec3(ray.direction);
  float curve = at.node.curve * dot(localDirection, localDirection);
  float a = bracket.x - bracket.z, b = bracket.y - bracket.z;
  float added = 0.0, change = 0.0;
  vec4 gradientValue;
  for (int i = 0; i < mostRefinements; ++i) {
    added += change;
    gradientValue = evaluateWithGradient(at.node.offset, at.node.degree, local + added * localDirection);
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
  cellLevelsValueDistance =
      uvec4(at.node.index, uint(at.node.degree) | at.depth << 8, floatBitsToUint(gradientValue.w),
            floatBitsToUint(float(ray.fromEye + first + double(added))));
}
