// Exact leaves (core/src/field/query/exact_leaf.h): the signed distance to the nearest triangle of a list. Positions are
// in world units from the domain's lower corner, or relative to a query point, so that single precision is enough.

layout(binding = 7) uniform usamplerBuffer exactLists;   // ExactTriangles::lists
layout(binding = 8) uniform samplerBuffer exactCorners;  // three texels for each triangle; see FieldUpload
layout(location = 20) uniform vec3 baseCell;             // edges of a base cell, world units
layout(location = 21) uniform float exactOffset;         // subtracted from all distances
layout(location = 22) uniform bool atTriangles;          // whether f - offset is 0 where an exact leaf's triangles are

const bool kExactLeaves = true;
const int kExactDegree = 31;  // in place of the degree of an exact leaf

// Distances that differ by less are taken for equal: a part of the distance, and a part of the domain's diagonal.
const float kEqualShare = 1e-5;
const float kEqualLength = 4e-7;
// Nearer to the surface than this, in domain diagonals, the direction to the closest point is not accurate.
const float kTouching = 2e-6;

const float kPi = 3.14159265;

Triangle fetchTriangle(uint index) {
  vec4 a = texelFetch(exactCorners, int(3u * index));
  vec4 b = texelFetch(exactCorners, int(3u * index + 1u));
  vec4 c = texelFetch(exactCorners, int(3u * index + 2u));
  return Triangle(a.xyz, b.xyz, c.xyz, vec3(a.w, b.w, c.w));
}

Triangle relativeTo(vec3 point, Triangle t) { return Triangle(t.a - point, t.b - point, t.c - point, t.normal); }

vec3 normalOf(uint triangle) { return fetchTriangle(triangle).normal; }

bool isExact(Node leaf) { return leaf.degree == kExactDegree; }

bool crossesAtTriangles(Node leaf) { return atTriangles && isExact(leaf); }

// Returns the ExactSign of an exact leaf.
uint signRule(Node leaf) { return floatBitsToUint(leaf.secondDerivative) & 3u; }

// Returns 1 or -1 if the distance has this sign in the whole leaf, else 0.
int constantSign(Node leaf) {
  uint rule = signRule(leaf);
  return rule == 1u ? 1 : rule == 2u ? -1 : 0;
}

bool signByWinding(Node leaf) { return signRule(leaf) == 3u; }

// Half of the edges of a cell, world units.
vec3 halfCell(uint depth) { return ldexp(baseCell, ivec3(-1 - int(depth))); }

vec3 worldOf(vec3 gridPoint) { return gridPoint * baseCell; }

vec3 worldPoint(uint depth, uvec3 cellIndex, vec3 local) {
  return (vec3(2u * cellIndex + 1u) + local) * halfCell(depth);
}

float cornerAngle(vec3 first, vec3 second) { return atan(length(cross(first, second)), dot(first, second)); }

// The nearest of some triangles, relative to the query point.
struct Nearest {
  float distance;
  vec3 difference;  // from the closest point to the query point
  // Sums over the triangles that are nearest within the tolerance. The weight of a triangle is its angle around the
  // closest point: that of its corner, or that of a half or a whole circle.
  vec3 normals;   // sum of weighted normals
  float outside;  // sum of the weighted distances from the triangles' planes; its sign is that of the distance
};

// The closest point of a triangle's side, from the origin to the side from `start` along `along`.
struct Closest {
  vec3 point;
  float squared;
  float end;  // 0 if the point is the start of the side, 1 if it is its other end
};

Closest closestOnSide(vec3 start, vec3 along) {
  float t = clamp(-dot(start, along) / max(dot(along, along), 1e-37), 0.0, 1.0);
  vec3 point = start + t * along;
  return Closest(point, dot(point, point), t);
}

void addTriangle(inout Nearest nearest, Triangle t, float tolerance) {
  vec3 ab = t.b - t.a, bc = t.c - t.b, ca = t.a - t.c;
  vec3 outside = vec3(dot(t.normal, cross(t.a, ab)), dot(t.normal, cross(t.b, bc)), dot(t.normal, cross(t.c, ca)));
  bool face = t.normal != vec3(0.0) && all(greaterThanEqual(outside, vec3(0.0)));
  Closest ofAb = closestOnSide(t.a, ab), ofBc = closestOnSide(t.b, bc), ofCa = closestOnSide(t.c, ca);
  Closest side = ofAb;
  vec3 before = ca, along = ab, after = bc;  // the sides of the triangle, beginning before the closest one
  if (ofBc.squared < side.squared) {
    side = ofBc;
    before = ab;
    along = bc;
    after = ca;
  }
  if (ofCa.squared < side.squared) {
    side = ofCa;
    before = bc;
    along = ca;
    after = ab;
  }
  vec3 difference = face ? -dot(t.normal, t.a) * t.normal : -side.point;
  float away = length(difference);
  float equal = tolerance + kEqualShare * nearest.distance;
  if (away > nearest.distance + equal) return;
  vec3 atCorner = side.end > 0.0 ? after : before;
  bool corner = side.end <= 0.0 || side.end >= 1.0;
  float weight = face ? 2.0 * kPi : corner ? cornerAngle(-along, atCorner) : kPi;
  if (away < nearest.distance - equal) {
    nearest.normals = vec3(0.0);
    nearest.outside = 0.0;
  }
  nearest.normals += weight * t.normal;
  nearest.outside += weight * dot(t.normal, difference);
  if (away < nearest.distance) {
    nearest.distance = away;
    nearest.difference = difference;
  }
}

// Projects a point in the direction of a segment from the origin to the plane of two coordinate axes, in which the
// segment becomes the origin. `end` is the segment's end and `axis` the axis along which it is longest.
vec2 projectAlong(vec3 end, int axis, vec3 point) {
  int x = (axis + 1) % 3, y = (axis + 2) % 3;
  precise vec2 projected = vec2(point[x], point[y]) - point[axis] * (vec2(end[x], end[y]) / end[axis]);
  return projected;
}

// Returns twice the area of a projected side's triangle with the origin (x), and 1, -1 or 0 (y) if the side crosses the
// positive half of the x axis upwards, downwards or not. For the two triangles at an edge, both numbers only differ in
// their signs, to the bit.
vec2 areaAndCrossing(vec2 from, vec2 to) {
  precise float area = from.x * to.y - to.x * from.y;
  bool startsAbove = from.y >= 0.0, endsAbove = to.y >= 0.0;
  if (startsAbove == endsAbove) return vec2(area, 0.0);
  return vec2(area, endsAbove ? float(area > 0.0) : -float(area < 0.0));
}

// Returns 1 if the segment from the origin passes through a triangle from its outer to its inner side, -1 if it passes
// the other way, and 0 if it does not pass through (core/src/field/query/exact_sign.cpp).
int passageThrough(vec3 end, Triangle t) {
  vec3 size = abs(end);
  int axis = size.x >= max(size.y, size.z) ? 0 : size.y >= size.z ? 1 : 2;
  vec2 a = projectAlong(end, axis, t.a), b = projectAlong(end, axis, t.b), c = projectAlong(end, axis, t.c);
  vec2 ofA = areaAndCrossing(b, c), ofB = areaAndCrossing(c, a), ofC = areaAndCrossing(a, b);
  int turns = int(ofA.y + ofB.y + ofC.y);
  vec3 weights = abs(vec3(ofA.x, ofB.x, ofC.x));
  float at = dot(weights, vec3(dot(t.a, end), dot(t.b, end), dot(t.c, end))) / (weights.x + weights.y + weights.z);
  bool isBetween = at > 0.0 && at < dot(end, end);
  return !isBetween ? 0 : end[axis] > 0.0 ? -turns : turns;
}

// Returns 1 or -1, the sign of the distance in a leaf whose sign comes from the winding number. The reference point,
// relative to the first corner of the first triangle, and its winding number follow the runs. The point is in world
// units from the domain's lower corner.
int signFromWinding(Node leaf, vec3 point) {
  int words = leaf.offset;
  while ((texelFetch(exactLists, words).x & 0x80000000u) == 0u) ++words;
  vec3 offset = uintBitsToFloat(uvec3(texelFetch(exactLists, words + 1).x, texelFetch(exactLists, words + 2).x,
                                      texelFetch(exactLists, words + 3).x));
  vec3 reference = fetchTriangle(texelFetch(exactLists, leaf.offset).x & 0x7ffffffu).a + offset;
  int winding = int(texelFetch(exactLists, words + 4).x);
  for (int at = leaf.offset; at <= words; ++at) {
    uint run = texelFetch(exactLists, at).x;
    uint triangle = run & 0x7ffffffu;
    uint end = triangle + (run >> 27 & 15u);
    for (; triangle <= end; ++triangle)
      winding += passageThrough(point - reference, relativeTo(reference, fetchTriangle(triangle)));
  }
  return winding > 0 ? -1 : 1;
}

float diagonalOfDomain() { return length(baseCell * vec3(grid)); }

Nearest nearestTriangle(Node leaf, vec3 point) {
  Nearest nearest = Nearest(kNever, vec3(0.0), vec3(0.0), 0.0);
  float tolerance = kEqualLength * diagonalOfDomain();
  bool last = false;
  for (int at = leaf.offset; !last; ++at) {
    uint run = texelFetch(exactLists, at).x;
    last = (run & 0x80000000u) != 0u;
    uint triangle = run & 0x7ffffffu;
    uint end = triangle + (run >> 27 & 15u);
    for (; triangle <= end; ++triangle) addTriangle(nearest, relativeTo(point, fetchTriangle(triangle)), tolerance);
  }
  return nearest;
}

// The exact distance (w) with its gradient in world units (xyz).
vec4 exactWithGradient(Node leaf, vec3 point) {
  Nearest nearest = nearestTriangle(leaf, point);
  int rule = signByWinding(leaf) ? signFromWinding(leaf, point) : constantSign(leaf);
  float outside = nearest.outside < 0.0 ? -1.0 : 1.0;
  float side = rule != 0 ? float(rule) : outside;
  float touchingDistance = kTouching * diagonalOfDomain();
  bool touching = nearest.distance <= touchingDistance;
  if (touching && signByWinding(leaf) && nearest.normals != vec3(0.0)) {
    // The sides of the face decide, because the point's own sign depends on rounding.
    vec3 normal = normalize(nearest.normals);
    vec3 foot = point - nearest.difference, beyond = 2.0 * touchingDistance * normal;
    int front = signFromWinding(leaf, foot + beyond), behind = signFromWinding(leaf, foot - beyond);
    if (front != behind) return vec4(float(front) * normal, side * nearest.distance - exactOffset);
  }
  vec3 direction = touching ? outside * nearest.normals : nearest.difference;
  float steepness = length(direction);
  return vec4(steepness > 0.0 ? side * direction / steepness : vec3(0.0), side * nearest.distance - exactOffset);
}

// The value of a leaf at local coordinates, without blending. The leaf has the integer coordinates `cellIndex` in units
// of its edge length.
float leafValue(Node leaf, uint depth, uvec3 cellIndex, vec3 local) {
  if (isExact(leaf)) return exactWithGradient(leaf, worldPoint(depth, cellIndex, local)).w;
  return evaluate(leaf.offset, leaf.degree, local);
}

// The gradient with respect to local coordinates (xyz) and the value (w) of a leaf.
vec4 leafWithGradient(Node leaf, uint depth, uvec3 cellIndex, vec3 local) {
  if (isExact(leaf)) {
    vec4 world = exactWithGradient(leaf, worldPoint(depth, cellIndex, local));
    return vec4(world.xyz * halfCell(depth), world.w);
  }
  return evaluateWithGradient(leaf.offset, leaf.degree, local);
}

// Crosses a triangle with a ray from the origin, and keeps the crossing if it is the first from its side.
void addCrossing(inout Crossings found, uint index, Triangle t, vec3 direction, float first, float last) {
  // The weight of a corner is the volume that the direction spans with the opposite side. Two triangles compute the
  // volume of their common edge with opposite signs, so that no ray passes between them.
  precise vec3 ofA = cross(t.b, t.c);
  precise vec3 ofB = cross(t.c, t.a);
  precise vec3 ofC = cross(t.a, t.b);
  precise float weightA = dot(direction, ofA);
  precise float weightB = dot(direction, ofB);
  precise float weightC = dot(direction, ofC);
  vec3 weights = vec3(weightA, weightB, weightC);
  float sum = weightA + weightB + weightC;
  bool fromOutside = all(lessThanEqual(weights, vec3(0.0))) && sum < 0.0;
  bool fromInside = all(greaterThanEqual(weights, vec3(0.0))) && sum > 0.0;
  if (!fromOutside && !fromInside) return;
  float at = dot(weights, vec3(dot(t.a, direction), dot(t.b, direction), dot(t.c, direction))) / sum;
  if (!(at >= first && at <= last)) return;
  if (fromOutside && at < found.fromOutside) {
    found.fromOutside = at;
    found.outer = index;
  }
  if (fromInside && at < found.fromInside) {
    found.fromInside = at;
    found.inner = index;
  }
}

// The first crossings of the ray start + t * direction with the triangles of an exact leaf, for t from `first` to `last`.
Crossings crossingsOf(Node leaf, vec3 start, vec3 direction, float first, float last) {
  Crossings found = Crossings(kNever, kNever, 0u, 0u);
  bool isLast = false;
  for (int at = leaf.offset; !isLast; ++at) {
    uint run = texelFetch(exactLists, at).x;
    isLast = (run & 0x80000000u) != 0u;
    uint triangle = run & 0x7ffffffu;
    uint end = triangle + (run >> 27 & 15u);
    for (; triangle <= end; ++triangle)
      addCrossing(found, triangle, relativeTo(start, fetchTriangle(triangle)), direction, first, last);
  }
  return found;
}
