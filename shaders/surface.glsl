// Code shared by the two passes that trace a surface (surface_march.frag, then surface_hit.frag): the ray of a pixel,
// the lookup of octree nodes along the ray, and the state of a pixel between the passes.

#ifdef HPSDF_WEB
layout(location = 1) uniform ivec2 firstPixel;
#else
flat in ivec2 toView;  // the pixel of the view minus that of the render target
#endif
layout(location = 2) uniform ivec2 size;
layout(location = 3) uniform dvec3 eye;      // the camera's eye, grid coordinates
layout(location = 4) uniform dvec3 forward;  // direction of view, world units
layout(location = 5) uniform dvec3 right;
layout(location = 6) uniform dvec3 up;
layout(location = 7) uniform dvec3 scale;  // change of the grid coordinates per world unit
layout(location = 8) uniform dvec2 pixelStep;
layout(location = 9) uniform float offset;
layout(location = 10) uniform float diagonal;  // diagonal of the domain, world units
layout(location = 15) uniform dvec3 shownLo;   // lower corner of the domain's visible part, grid coordinates
layout(location = 16) uniform dvec3 shownHi;
layout(location = 17) uniform bool parallel;  // whether the rays are parallel (orthographic camera)

// The state of each pixel after a march pass. The integers are March::kind, the bits of the floats March::t and
// March::side, and March::lastLeaf. For the kind kBracketed, the floats are a, b and a first guess of the root, which
// lies between a and b. For the kind kUnderWay, the floats are March::lastHeight and March::longestStep. For the kind
// kOnTriangle, the last integer is the triangle, and the first float is the length from t to the triangle.
layout(binding = 2) uniform usampler2D stateIntegers;
layout(binding = 3) uniform sampler2D stateFloats;

const uint kMiss = 0u;
const uint kUnderWay = 1u;
const uint kOnFace = 2u;     // the ray crosses the surface at t, where it enters a leaf
const uint kBracketed = 3u;   // the ray crosses the surface between a and b, within one leaf
const uint kOnTriangle = 4u;  // the ray crosses a triangle of an exact leaf

struct Ray {
  dvec3 worldDirection;  // unit direction in world coordinates
  dvec3 origin;          // entry into the visible part of the domain, grid coordinates
  dvec3 direction;       // change of the grid coordinates per world unit along the ray
  double fromEye;        // distance from the start of the pixel's ray to `origin`, world units
  double length;         // length within the visible part, world units; negative for a ray that misses it
};

// Adds to `middle` the vector from the centre of the picture to this pixel.
dvec3 onPicture(dvec3 middle) {
#ifdef HPSDF_WEB
  ivec2 pixel = firstPixel + ivec2(gl_FragCoord.xy);
#else
  ivec2 pixel = toView + ivec2(gl_FragCoord.xy);
#endif
  return middle + right * (double(2 * pixel.x + 1 - size.x) * pixelStep.x) +
         up * (double(size.y - 2 * pixel.y - 1) * pixelStep.y);
}

Ray pixelRay() {
  Ray ray;
  dvec3 start = eye;
  if (parallel) {
    start += onPicture(dvec3(0.0lf)) * scale;
    ray.worldDirection = forward;
  } else {
    ray.worldDirection = onPicture(forward);
    ray.worldDirection /= sqrt(dot(ray.worldDirection, ray.worldDirection));
  }
  ray.direction = ray.worldDirection * scale;
  double first = 0.0lf;
  double last = 1e300lf;
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.direction[axis] != 0.0lf) {
      double toLo = (shownLo[axis] - start[axis]) / ray.direction[axis];
      double toHi = (shownHi[axis] - start[axis]) / ray.direction[axis];
      first = max(first, min(toLo, toHi));
      last = min(last, max(toLo, toHi));
    } else if (!(start[axis] >= shownLo[axis] && start[axis] <= shownHi[axis])) {
      last = -1.0lf;
    }
  }
  ray.origin = start + first * ray.direction;
  ray.fromEye = first;
  ray.length = first < last ? last - first : -1.0lf;
  return ray;
}

// A point and an octree node that contains it.
struct CellPoint {
  Node node;
  uint depth;
  float scale;    // 2^depth
  vec3 base;      // lower corner of the base cell, grid coordinates
  uvec3 path;     // lower corner of the node within its base cell, in units of the node's edge length
  vec3 fraction;  // position of the point within the node, in [0, 1]^3
};

// The base cell that contains a point, with the point's position in this cell.
CellPoint baseCellAt(vec3 p) {
  p = clamp(p, vec3(0.0), vec3(grid));
  uvec3 base = min(uvec3(p), grid - 1u);
  CellPoint at;
  at.node = fetchNode(baseCellIndex(base));
  at.depth = 0u;
  at.scale = 1.0;
  at.base = vec3(base);
  at.path = uvec3(0u);
  at.fraction = p - at.base;
  return at;
}

// Replaces the node by its child that contains the point.
void descend(inout CellPoint at) {
  vec3 doubled = 2.0 * at.fraction;
  uvec3 upper = uvec3(greaterThanEqual(doubled, vec3(1.0)));
  at.fraction = doubled - vec3(upper);
  at.path = 2u * at.path + upper;
  at.node = fetchNode(childIndex(at.node, upper));
  ++at.depth;
  at.scale *= 2.0;
}

// The integer coordinates of the node, in units of its own edge length from the domain's lower corner.
uvec3 cellIndexOf(CellPoint at) { return (uvec3(at.base) << at.depth) + at.path; }
