// Lookup and evaluation of a field; the same steps under the same names as render/src/cpu/trace.cpp.
// Positions are in grid coordinates: the domain is [0, grid], a base cell a unit cube.

layout(binding = 0) uniform usamplerBuffer nodes;        // see FieldUpload
layout(binding = 1) uniform samplerBuffer coefficients;  // see FieldData
layout(location = 0) uniform uvec3 grid;

const uint kNoCell = 0xffffffffu;

struct Node {
  uint index;
  bool leaf;
  uint firstChild;  // of an internal node
  int degree;       // of a leaf
  int offset;       // of a leaf's coefficients
  float lo, hi;     // of an internal node: the field's values lie between
  float rest;       // of a leaf: the value differs from the linear part's by at most this
  float bend;       // of a leaf: the gradient in local coordinates differs from the linear part's by at most this
  float curve;      // of a leaf: largest second derivative in local coordinates
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
  node.rest = uintBitsToFloat(texel.y);
  node.bend = uintBitsToFloat(texel.z);
  node.curve = uintBitsToFloat(texel.w);
  node.leaf = node.bend >= 0.0;
  return node;
}

uint baseCellIndex(uvec3 base) { return (base.z * grid.y + base.y) * grid.x + base.x; }

uint childIndex(Node node, uvec3 upper) { return node.firstChild + upper.x + 2u * upper.y + 4u * upper.z; }

// L_i and L_{i-1} to L_{i+1} and L_i.
void advance(inout float value, inout float before, float x, float i) {
  float product = x * value;
  float next = product + (product - before) * (i / (i + 1.0));
  before = value;
  value = next;
}

// The polynomial at local coordinates in [-1, 1]^3.
float evaluate(int offset, int degree, vec3 local) {
  float value = 0.0;
  float x = 1.0, xBefore = 0.0;
  for (int i = 0; i <= degree; ++i) {
    float plane = 0.0;
    float y = 1.0, yBefore = 0.0;
    for (int j = 0; j <= degree - i; ++j) {
      float line = 0.0;
      float z = 1.0, zBefore = 0.0;
      for (int k = 0; k <= degree - i - j; ++k) {
        line += texelFetch(coefficients, offset++).x * z;
        advance(z, zBefore, local.z, float(k));
      }
      plane += line * y;
      advance(y, yBefore, local.y, float(j));
    }
    value += plane * x;
    advance(x, xBefore, local.x, float(i));
  }
  return value;
}
