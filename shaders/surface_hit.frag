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

// L_i' to L_{i+1}', where `value` is L_i.
void advanceDerivative(inout float derivative, inout float before, float value, int i) {
  float next = before + float(2 * i + 1) * value;
  before = derivative;
  derivative = next;
}

// Gradient with respect to local coordinates, and value.
vec4 evaluateWithGradientAny(int index, int degree, vec3 local) {
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

vec4 evaluateStraightWithGradient(Straight s, vec3 one) {
  vec3 two = legendre2(one), three = legendre3(one), four = legendre4(one);
  vec3 twoSlope = 3.0 * one;
  vec3 threeSlope = 7.5 * one * one - 1.5;
  vec3 fourSlope = (17.5 * one * one - 7.5) * one;
  // xIyJ: the sum over k of c_IJk L_k; xI: that over j of xIyJ L_j
  float x0y1 = s.b.x + s.b.y * one.z + s.b.z * two.z + s.f.y * three.z;
  float x0y2 = s.b.w + s.c.x * one.z + s.f.z * two.z;
  float x0y3 = s.c.y + s.f.w * one.z;
  float x1y1 = s.d.y + s.d.z * one.z + s.g.z * two.z;
  float x1y2 = s.d.w + s.g.w * one.z;
  float x2y1 = s.e.z + s.h.z * one.z;
  float x0 = s.a.x + s.a.y * one.z + s.a.z * two.z + s.a.w * three.z + s.f.x * four.z +  //
             x0y1 * one.y + x0y2 * two.y + x0y3 * three.y + s.g.x * four.y;
  float x1 = s.c.z + s.c.w * one.z + s.d.x * two.z + s.g.y * three.z +  //
             x1y1 * one.y + x1y2 * two.y + s.h.x * three.y;
  float x2 = s.e.x + s.e.y * one.z + s.h.y * two.z + x2y1 * one.y + s.h.w * two.y;
  float x3 = s.e.w + s.i.x * one.z + s.i.y * one.y;
  vec4 result;
  result.x = x1 + x2 * twoSlope.x + x3 * threeSlope.x + s.i.z * fourSlope.x;
  result.y = x0y1 + x0y2 * twoSlope.y + x0y3 * threeSlope.y + s.g.x * fourSlope.y +
             (x1y1 + x1y2 * twoSlope.y + s.h.x * threeSlope.y) * one.x + (x2y1 + s.h.w * twoSlope.y) * two.x +
             s.i.y * three.x;
  result.z = s.a.y + s.a.z * twoSlope.z + s.a.w * threeSlope.z + s.f.x * fourSlope.z +
             (s.b.y + s.b.z * twoSlope.z + s.f.y * threeSlope.z) * one.y + (s.c.x + s.f.z * twoSlope.z) * two.y +
             s.f.w * three.y +
             (s.c.w + s.d.x * twoSlope.z + s.g.y * threeSlope.z + (s.d.z + s.g.z * twoSlope.z) * one.y +
              s.g.w * two.y) * one.x +
             (s.e.y + s.h.y * twoSlope.z + s.h.z * one.y) * two.x + s.i.x * three.x;
  result.w = x0 + x1 * one.x + x2 * two.x + x3 * three.x + s.i.z * four.x;
  return result;
}

vec4 evaluateWithGradient(int offset, int degree, vec3 local) {
  if (degree > kStraight) return evaluateWithGradientAny(offset, degree, local);
  return evaluateStraightWithGradient(fetchStraight(offset, degree), local);
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
  bool crack = !bracketed && abs(gradientValue.w - offset) > kCrack * diagonal * max(1.0, steepness);
  cellLevelsValueDistance =
      uvec4(at.node.index, uint(at.node.degree) | at.depth << 8 | uint(crack) << 16, floatBitsToUint(gradientValue.w),
            floatBitsToUint(float(ray.fromEye + first + double(added))));
}
