// Lookup and evaluation of a field. Positions are in grid coordinates: the domain is [0, grid], and each base cell
// (root cell of the octree) is a unit cube.

layout(binding = 0) uniform usamplerBuffer nodes;        // octree nodes, packed as described at class FieldUpload
layout(binding = 1) uniform samplerBuffer coefficients;  // coefficients of the leaves' polynomials
layout(binding = 5) uniform samplerBuffer coefficientQuads;  // the same coefficients, four per texel
layout(location = 0) uniform uvec3 grid;

const uint kNoCell = 0xffffffffu;

struct Node {
  uint index;
  bool leaf;
  // Members for internal nodes:
  uint firstChild;
  float lo, hi;  // lower and upper bound of the field in the node
  // Members for leaves; the last three are bounds as in SurfaceBounds:
  int degree;
  int offset;  // index of the first coefficient
  float valueDeviation, gradientDeviation, secondDerivative;
};

Node fetchNode(uint index) {
  uvec4 texel = texelFetch(nodes, int(index));
  Node node;
  node.index = index;
  node.firstChild = texel.x;
  node.degree = int(texel.x >> 27);
  node.offset = int(texel.x & 0x7ffffffu);
  node.lo = uintBitsToFloat(texel.y << 16);
  node.hi = uintBitsToFloat(texel.y & 0xffff0000u);
  node.valueDeviation = uintBitsToFloat(texel.y);
  node.gradientDeviation = uintBitsToFloat(texel.z);
  node.secondDerivative = uintBitsToFloat(texel.w);
  node.leaf = node.gradientDeviation >= 0.0;
  return node;
}

// Data about the blending of neighbouring leaves at a point of a leaf. All members are 0 in a field without blending.
struct BlendZone {
  bool inside;                                        // whether other leaves may have a blending weight at the point
  float valueDifference, gradientDifference, extent;  // bounds of the blending, as in BlendZoneBounds
  float width;                                        // width of the blend zones, as a share of the leaf's edge
};

// A triangle of an exact leaf, in world units.
struct Triangle {
  vec3 a, b, c;  // corners, from the domain's lower corner or from another point
  vec3 normal;   // unit normal, or zero for a triangle without area
};

const float kNever = 1e30;

// The first crossings of a ray through triangles, from their outer and from their inner sides.
struct Crossings {
  float fromOutside, fromInside;  // lengths along the ray, or kNever
  uint outer, inner;              // indices of the triangles
};

// The value of the field at a point, and the range of the values that the blended leaf polynomials have at this point.
struct FieldRange {
  float value, lowest, highest;
};

uint baseCellIndex(uvec3 base) { return (base.z * grid.y + base.y) * grid.x + base.x; }

uint childIndex(Node node, uvec3 upper) { return node.firstChild + upper.x + 2u * upper.y + 4u * upper.z; }

// Steps the Legendre recurrence: replaces the values L_i(x) and L_{i-1}(x) by L_{i+1}(x) and L_i(x).
void nextLegendre(inout float value, inout float previous, float x, float i) {
  float product = x * value;
  float next = product + (product - previous) * (i / (i + 1.0));
  previous = value;
  value = next;
}

// Polynomials up to this degree are evaluated without loops and with loads of four coefficients, because loops and
// single loads are slow on llvmpipe. The terms up to degree 3 are stored first, then the terms of degree 4.
const int kLowDegree = 4;

struct LowDegree {
  vec4 a;  // coefficients c_000 to c_003
  vec4 b;  // coefficients c_010, c_011, c_012, c_020
  vec4 c;  // coefficients c_021, c_030, c_100, c_101
  vec4 d;  // coefficients c_102, c_110, c_111, c_120
  vec4 e;  // coefficients c_200, c_201, c_210, c_300
  vec4 f;  // coefficients c_004, c_013, c_022, c_031
  vec4 g;  // coefficients c_040, c_103, c_112, c_121
  vec4 h;  // coefficients c_130, c_202, c_211, c_220
  vec4 i;  // coefficients c_301, c_310, c_400
};

LowDegree fetchLowDegree(int offset, int degree) {
  int first = offset / 4;
  LowDegree s;
  s.a = texelFetch(coefficientQuads, first);
  s.b = texelFetch(coefficientQuads, first + 1);
  s.c = texelFetch(coefficientQuads, first + 2);
  s.d = texelFetch(coefficientQuads, first + 3);
  s.e = texelFetch(coefficientQuads, first + 4);
  s.f = s.g = s.h = s.i = vec4(0.0);
  if (degree == kLowDegree) {
    s.f = texelFetch(coefficientQuads, first + 5);
    s.g = texelFetch(coefficientQuads, first + 6);
    s.h = texelFetch(coefficientQuads, first + 7);
    s.i = texelFetch(coefficientQuads, first + 8);
  }
  return s;
}

// The functions legendre2 to legendre4 evaluate the Legendre polynomials L_2, L_3 and L_4 of each coordinate.
vec3 legendre2(vec3 x) { return 1.5 * x * x - 0.5; }
vec3 legendre3(vec3 x) { return (2.5 * x * x - 1.5) * x; }
vec3 legendre4(vec3 x) { return (4.375 * x * x - 3.75) * x * x + 0.375; }

float evaluateLowDegree(LowDegree s, vec3 one) {
  vec3 two = legendre2(one), three = legendre3(one), four = legendre4(one);
  float x0 = s.a.x + s.a.y * one.z + s.a.z * two.z + s.a.w * three.z + s.f.x * four.z +
             (s.b.x + s.b.y * one.z + s.b.z * two.z + s.f.y * three.z) * one.y +
             (s.b.w + s.c.x * one.z + s.f.z * two.z) * two.y + (s.c.y + s.f.w * one.z) * three.y + s.g.x * four.y;
  float x1 = s.c.z + s.c.w * one.z + s.d.x * two.z + s.g.y * three.z +
             (s.d.y + s.d.z * one.z + s.g.z * two.z) * one.y + (s.d.w + s.g.w * one.z) * two.y + s.h.x * three.y;
  float x2 = s.e.x + s.e.y * one.z + s.h.y * two.z + (s.e.z + s.h.z * one.z) * one.y + s.h.w * two.y;
  float x3 = s.e.w + s.i.x * one.z + s.i.y * one.y;
  return x0 + x1 * one.x + x2 * two.x + x3 * three.x + s.i.z * four.x;
}

// Evaluates the polynomial of a leaf of any degree at local coordinates in [-1, 1]^3.
float evaluateAnyDegree(int offset, int degree, vec3 local) {
  float value = 0.0;
  float x = 1.0, xPrevious = 0.0;
  for (int i = 0; i <= degree; ++i) {
    float plane = 0.0;
    float y = 1.0, yPrevious = 0.0;
    for (int j = 0; j <= degree - i; ++j) {
      float line = 0.0;
      float z = 1.0, zPrevious = 0.0;
      for (int k = 0; k <= degree - i - j; ++k) {
        line += texelFetch(coefficients, offset++).x * z;
        nextLegendre(z, zPrevious, local.z, float(k));
      }
      plane += line * y;
      nextLegendre(y, yPrevious, local.y, float(j));
    }
    value += plane * x;
    nextLegendre(x, xPrevious, local.x, float(i));
  }
  return value;
}

float evaluate(int offset, int degree, vec3 local) {
  if (degree > kLowDegree) return evaluateAnyDegree(offset, degree, local);
  return evaluateLowDegree(fetchLowDegree(offset, degree), local);
}

// Steps the recurrence of the Legendre derivatives: replaces L_i' and L_{i-1}' by L_{i+1}' and L_i'. `value` is L_i.
void nextDerivative(inout float derivative, inout float previous, float value, int i) {
  float next = previous + float(2 * i + 1) * value;
  previous = derivative;
  derivative = next;
}

// Evaluates the polynomial of a leaf. Returns its gradient with respect to local coordinates (xyz) and its
// value (w).
vec4 evaluateAnyDegreeWithGradient(int index, int degree, vec3 local) {
  float value = 0.0;
  vec3 gradient = vec3(0.0);
  float x = 1.0, xPrevious = 0.0, dx = 0.0, dxPrevious = 0.0;
  for (int i = 0; i <= degree; ++i) {
    float y = 1.0, yPrevious = 0.0, dy = 0.0, dyPrevious = 0.0;
    for (int j = 0; j <= degree - i; ++j) {
      float line = 0.0, lineDz = 0.0;
      float z = 1.0, zPrevious = 0.0, dz = 0.0, dzPrevious = 0.0;
      for (int k = 0; k <= degree - i - j; ++k) {
        float c = texelFetch(coefficients, index++).x;
        line += c * z;
        lineDz += c * dz;
        nextDerivative(dz, dzPrevious, z, k);
        nextLegendre(z, zPrevious, local.z, float(k));
      }
      value += line * y * x;
      gradient += vec3(line * y * dx, line * dy * x, lineDz * y * x);
      nextDerivative(dy, dyPrevious, y, j);
      nextLegendre(y, yPrevious, local.y, float(j));
    }
    nextDerivative(dx, dxPrevious, x, i);
    nextLegendre(x, xPrevious, local.x, float(i));
  }
  return vec4(gradient, value);
}

vec4 evaluateLowDegreeWithGradient(LowDegree s, vec3 one) {
  vec3 two = legendre2(one), three = legendre3(one), four = legendre4(one);
  vec3 twoSlope = 3.0 * one;
  vec3 threeSlope = 7.5 * one * one - 1.5;
  vec3 fourSlope = (17.5 * one * one - 7.5) * one;
  // Partial sums: xIyJ is the sum over k of c_IJk L_k(z), and xI is the sum over j of xIyJ L_j(y).
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
  if (degree > kLowDegree) return evaluateAnyDegreeWithGradient(offset, degree, local);
  return evaluateLowDegreeWithGradient(fetchLowDegree(offset, degree), local);
}
