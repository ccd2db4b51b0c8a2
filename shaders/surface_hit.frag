// Second pass of a surface: from the bracket of the first crossing to the hit itself, the ray's positions in double
// precision. A pixel still under way counts as a miss.

layout(location = 11) uniform int mostRefinements;

layout(location = 0) out uvec4 cellLevelsValueDistance;  // degree | depth << 8; value and distance as bits of floats
layout(location = 1) out vec4 normal;

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
  normal = vec4(0.0);
  uvec4 integers = texelFetch(stateIntegers, ivec2(gl_FragCoord.xy), 0);
  cellLevelsValueDistance = uvec4(kNoCell, integers.x, 0u, 0u);
  if (integers.x < kOnFace) return;
  vec4 bracket = texelFetch(stateFloats, ivec2(gl_FragCoord.xy), 0);
  bool bracketed = integers.x == kBracketed;
  float side = uintBitsToFloat(integers.z);

  Ray ray = pixelRay();
  double t = double(uintBitsToFloat(integers.y));
  // the march stood in this leaf when it found the bracket, and finds it again from the same point
  float tInLeaf = bracketed ? bracket.x : float(t);
  CellPoint at = baseCellAt(vec3(ray.origin) + tInLeaf * vec3(ray.direction));
  while (!at.node.leaf) descend(at);

  if (bracketed) {
    // regula falsi, Illinois variant
    double a = double(bracket.x), b = double(bracket.z);
    float heightA = bracket.y, heightB = bracket.w;
    t = b;
    for (int i = 0; i < mostRefinements; ++i) {
      double next = b - double(heightB) * (b - a) / double(heightB - heightA);
      double change = abs(next - t);
      t = next;
      if (change <= double(kConverged * diagonal)) break;
      float height = side * (evaluate(at.node.offset, at.node.degree, localAt(at, ray, t)) - offset);
      if ((height > 0.0) == (heightB > 0.0)) {
        heightA *= 0.5;
      } else {
        a = b;
        heightA = heightB;
      }
      b = t;
      heightB = height;
    }
  }
  vec4 gradientValue = evaluateWithGradient(at.node.offset, at.node.degree, localAt(at, ray, t));
  vec3 gradient = gradientValue.xyz * vec3(scale);
  float steepness = length(gradient);
  // a cell of degree 0 has no gradient: face the eye
  normal.xyz = steepness > 0.0 ? gradient / steepness : -vec3(ray.worldDirection);
  cellLevelsValueDistance = uvec4(at.node.index, uint(at.node.degree) | at.depth << 8,
                                  floatBitsToUint(gradientValue.w), floatBitsToUint(float(ray.fromEye + t)));
}
