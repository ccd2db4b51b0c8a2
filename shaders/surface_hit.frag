// Second pass for a surface: refines the first root of f - offset along each ray. The march pass has found a bracket of
// the root. Positions along the ray are in double precision. A pixel whose march has not ended counts as a miss.

layout(location = 11) uniform int mostRefinements;

// The components are the cell, degree | depth << 8 | crack << 16, and the bits of the floats value and distance.
layout(location = 0) out uvec4 cellLevelsValueDistance;
layout(location = 1) out vec4 normal;

const float kTurned = 1e-4;     // greatest turn of the gradient in the last Newton step, roughly in radians
const float kInfinity = 1e30;
const float kConverged = 1e-8;  // refinement ends when the root changes by less, in domain diagonals; as in trace.cpp
const float kExactRounding = 2e-7;  // in place of kConverged for exact distances, which single precision rounds by about that
const float kCrack = 4e-6;      // a greater jump at slopes up to 1 is a crack; in domain diagonals; as in trace.h

vec3 localAt(CellPoint cell, Ray ray, double t) {
  dvec3 inBase = ray.origin - dvec3(cell.base) + t * ray.direction;
  return vec3(2.0lf * (inBase * double(cell.scale) - dvec3(cell.path)) - 1.0lf);
}

// The root of f - offset along a ray, with the field's value and gradient there.
struct Root {
  float added;          // distance from the first guess, world units
  vec4 gradientValue;  // gradient in local coordinates (xyz) and value (w) at the root
};

// Refines the root in the bracket [a, b] by Newton's method, or by bisection where a Newton step would leave the
// bracket. Without a bracket, only evaluates the field. Bracket and root are distances along the ray from the point
// `local`, so that single precision is enough.
Root refine(CellPoint at, vec3 local, vec3 localDirection, float side, bool bracketed, float a, float b) {
  uvec3 cellIndex = cellIndexOf(at);
  bool blended = blendZoneAt(at.node.index, at.fraction).inside;
  float curve = blended ? kInfinity : at.node.secondDerivative * dot(localDirection, localDirection);
  float added = 0.0, change = 0.0;
  vec4 gradientValue;
  for (int i = 0; i < mostRefinements; ++i) {
    added += change;
    gradientValue = fieldWithGradient(at.node, at.depth, cellIndex, local + added * localDirection);
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
    // `turned` bounds the relative change of the slope in the step. A Newton step ends at most turned * |change| / 2
    // away from the root.
    float turned = newton ? abs(curve / slope * change) : kInfinity;
    float exactlyEnough = isExact(at.node) ? kExactRounding : kConverged;
    bool close = turned <= kTurned && turned * abs(change) <= 2.0 * kConverged * diagonal;
    if (close || abs(change) <= exactlyEnough * diagonal) break;
  }
  added += change;
  gradientValue.w += change * dot(gradientValue.xyz, localDirection);
  return Root(added, gradientValue);
}

// The length along the ray from `point`, in world units from the domain's lower corner, to the crossing with a triangle.
// The ray may pass a little beside the triangle because of rounding.
double lengthToTriangle(dvec3 point, dvec3 direction, Triangle t) {
  dvec3 a = dvec3(t.a) - point, b = dvec3(t.b) - point, c = dvec3(t.c) - point;
  dvec3 weights = dvec3(dot(direction, cross(b, c)), dot(direction, cross(c, a)), dot(direction, cross(a, b)));
  double sum = weights.x + weights.y + weights.z;
  weights = max(weights * sign(sum), dvec3(0.0lf));
  return dot(weights, dvec3(dot(a, direction), dot(b, direction), dot(c, direction))) /
         (weights.x + weights.y + weights.z);
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

  // Find the leaf that contains the last point of the march.
  Ray ray = pixelRay();
  CellPoint at = baseCellAt(vec3(ray.origin) + t * vec3(ray.direction));
  while (!at.node.leaf) descend(at);

  double first = double(bracketed ? bracket.z : t);
  vec3 localDirection = 2.0 * at.scale * vec3(ray.direction);
  if (kExactLeaves && integers.x == kOnTriangle) {
    Triangle triangle = fetchTriangle(integers.w);
    double added = lengthToTriangle((ray.origin + first * ray.direction) / scale, ray.worldDirection, triangle);
    if (!(abs(added) < 1e30lf)) added = double(bracket.x);
    normal.xyz = triangle.normal;
    cellLevelsValueDistance = uvec4(at.node.index, uint(at.node.degree) | at.depth << 8, floatBitsToUint(offset),
                                    floatBitsToUint(float(ray.fromEye + first + added)));
    return;
  }
  Root root = refine(at, localAt(at, ray, first), localDirection, side, bracketed, bracket.x - bracket.z,
                     bracket.y - bracket.z);
  float value = root.gradientValue.w;
  vec3 gradient = root.gradientValue.xyz * vec3(scale);
  float steepness = length(gradient);
  // A cell of degree 0 has no gradient; its normal points to the eye.
  normal.xyz = steepness > 0.0 ? gradient / steepness : -vec3(ray.worldDirection);
  bool crack = !bracketed && abs(value - offset) > kCrack * diagonal * max(1.0, steepness);
  cellLevelsValueDistance =
      uvec4(at.node.index, uint(at.node.degree) | at.depth << 8 | uint(crack) << 16, floatBitsToUint(value),
            floatBitsToUint(float(ray.fromEye + first + double(root.added))));
}
