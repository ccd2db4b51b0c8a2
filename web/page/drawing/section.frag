// Shows sections of the field with two planes in the picture of a surface: with the plane that cuts the surface open, where the field is
// below the offset, and with the plane of the slice. Where both are hit, the cut is shown.

uniform vec4 planes[2];  // the cut and the slice: normal, and distance from the origin along it, in grid coordinates; zero: none
uniform vec3 nudge;      // added to points of the cut before their cells are looked up, so that cells behind it are found

// The cell, degree | depth << 8 | number of the plane << 24 from 1 on, and the bits of the floats value and distance.
layout(location = 0) out uvec4 cellLevelsValueDistance;

// A plane across an axis keeps its exact place, because it may lie on faces between cells.
vec3 onPlane(vec3 p, vec4 plane) {
  for (int axis = 0; axis < 3; ++axis)
    if (plane[axis] == 1.0 && dot(plane.xyz, plane.xyz) == 1.0) p[axis] = plane.w;
  return p;
}

bool isWithin(vec3 p, vec3 lower, vec3 upper) {
  return all(greaterThanEqual(p, lower)) && all(lessThanEqual(p, upper));
}

void main() {
  cellLevelsValueDistance = uvec4(kNoCell, 0u, 0u, 0u);
  Ray ray = pixelRay();
  vec3 start = vec3(ray.origin - ray.fromEye * ray.direction), direction = vec3(ray.direction);
  for (int n = 0; n < 2; ++n) {
    vec4 plane = planes[n];
    float t = (plane.w - dot(plane.xyz, start)) / dot(plane.xyz, direction);
    if (plane.xyz == vec3(0.0) || !(t > 0.0)) continue;
    vec3 p = onPlane(start + t * direction, plane);
    bool isCut = n == 0;
    if (!(isCut ? isWithin(p, vec3(0.0), vec3(grid)) : isWithin(p, vec3(shownLo), vec3(shownHi)))) continue;
    CellPoint at = baseCellAt(isCut ? p + nudge : p);
    while (!at.node.leaf) descend(at);
    float value = fieldValue(at.node, at.depth, cellIndexOf(at), 2.0 * at.fraction - 1.0);
    if (isCut && !(value < offset)) continue;
    cellLevelsValueDistance = uvec4(at.node.index, uint(at.node.degree) | at.depth << 8 | uint(n + 1) << 24,
                                    floatBitsToUint(value), floatBitsToUint(t));
    return;
  }
}
