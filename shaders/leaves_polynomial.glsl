// The functions of leaves_exact.glsl for a field without exact leaves: the function of a leaf is its polynomial.

const bool kExactLeaves = false;

float leafValue(Node leaf, uint depth, uvec3 cellIndex, vec3 local) {
  return evaluate(leaf.offset, leaf.degree, local);
}

vec4 leafWithGradient(Node leaf, uint depth, uvec3 cellIndex, vec3 local) {
  return evaluateWithGradient(leaf.offset, leaf.degree, local);
}

bool isExact(Node leaf) { return false; }

bool crossesAtTriangles(Node leaf) { return false; }

Crossings crossingsOf(Node leaf, vec3 start, vec3 direction, float first, float last) {
  return Crossings(kNever, kNever, 0u, 0u);
}

vec3 normalOf(uint triangle) { return vec3(0.0); }

vec3 worldOf(vec3 gridPoint) { return vec3(0.0); }

int constantSign(Node leaf) { return 0; }
bool signByWinding(Node leaf) { return false; }
int signFromWinding(Node leaf, vec3 point) { return 0; }

vec3 halfCell(uint depth) { return vec3(0.0); }

Triangle fetchTriangle(uint index) { return Triangle(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0)); }
