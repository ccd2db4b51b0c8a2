// First pass of a surface: TraceField::trace up to the leaf and the bracket of the first crossing of f = offset.
// After `mostSteps` a pixel is left under way and the pass drawn again: llvmpipe ends all loops of a shader without a
// word once they have run 65535 times together.

layout(location = 11) uniform int mostSteps;
layout(location = 12) uniform bool resume;  // draw again: takes up the pixels under way, leaves the others

layout(location = 14) uniform float startSide;

flat in float start;

layout(location = 0) out uvec4 integers;
layout(location = 1) out vec4 floats;

const float kNudge = 1e-6;  // in domain diagonals: beyond a face; also the shortest step; as in trace.cpp

const float kPastFace = 4e-7;  // of the grid; as in trace.cpp

const float kInfinity = 1e30;

bool excludes(Node node) { return node.lo > offset || node.hi < offset; }

// World length from the point to where the ray has left the node's box, past a face by a little: see trace.cpp.
// `inverse`: of the absolute direction, infinite for an axis along which the ray does not move.
float lengthToExit(CellPoint at, vec3 direction, vec3 inverse) {
  vec3 ahead = mix(at.fraction, 1.0 - at.fraction, greaterThan(direction, vec3(0.0)));
  vec3 exits = mix((ahead / at.scale + kPastFace * vec3(grid)) * inverse, vec3(kInfinity), equal(direction, vec3(0.0)));
  return min(exits.x, min(exits.y, exits.z));
}

// Slope of the leaf's linear part along a direction in local coordinates.
float linearSlope(Node leaf, vec3 localDirection) {
  if (leaf.degree == 0) return 0.0;
  // c_100, c_010, c_001 in lexicographic order
  float cz = texelFetch(coefficients, leaf.offset + 1).x;
  float cy = texelFetch(coefficients, leaf.offset + leaf.degree + 1).x;
  float cx = texelFetch(coefficients, leaf.offset + (leaf.degree + 1) * (leaf.degree + 2) / 2).x;
  return cx * localDirection.x + cy * localDirection.y + cz * localDirection.z;
}

void main() {
  Ray ray = pixelRay();
  float nudge = kNudge * diagonal;
  float t = max(0.0, float(double(start) - ray.fromEye) - 4.0 * nudge);
  float side = t > 0.0 ? startSide : 0.0;  // of the surface, on which the ray starts: the height above the surface is side * (f - offset)
  // what the step before has left where it stayed in its leaf: the height at t, and the longest step to try
  uint lastLeaf = kNoCell;
  float lastHeight = 0.0, reach = 0.0;
  if (resume) {
    uvec4 before = texelFetch(stateIntegers, ivec2(gl_FragCoord.xy), 0);
    if (before.x != kUnderWay) discard;
    vec4 last = texelFetch(stateFloats, ivec2(gl_FragCoord.xy), 0);
    t = uintBitsToFloat(before.y);
    side = uintBitsToFloat(before.z);
    lastLeaf = before.w;
    lastHeight = last.x;
    reach = last.y;
  }
  uint kind = kUnderWay;
  vec4 bracket = vec4(0.0);

  vec3 origin = vec3(ray.origin);
  vec3 direction = vec3(ray.direction);
  vec3 inverse = abs(1.0 / direction);
  float rayLength = float(ray.length);

  for (int step = 0; step < mostSteps; ++step) {
    if (!(t <= rayLength)) {
      kind = kMiss;
      break;
    }
    CellPoint at = baseCellAt(origin + t * direction);
    while (!at.node.leaf && !excludes(at.node)) descend(at);
    float toExit = lengthToExit(at, direction, inverse);
    if (excludes(at.node)) {
      float sideHere = at.node.lo > offset ? 1.0 : -1.0;
      if (side == 0.0) side = sideHere;
      if (side != sideHere) {
        kind = kOnFace;
        break;
      }
      t += toExit + nudge;
      continue;
    }
    if (at.node.index != lastLeaf) {
      float here = evaluate(at.node.offset, at.node.degree, 2.0 * at.fraction - 1.0) - offset;
      if (side == 0.0) side = here >= 0.0 ? 1.0 : -1.0;
      lastLeaf = at.node.index;
      lastHeight = side * here;
      reach = kInfinity;
      if (lastHeight < 0.0) {
        kind = kOnFace;
        break;
      }
    }
    // within this leaf the height's slope along the ray lies between these two, its second derivative in +-curve
    vec3 localDirection = 2.0 * at.scale * direction;
    float slope = side * linearSlope(at.node, localDirection);
    float bend = at.node.bend * length(localDirection);
    float curve = at.node.curve * dot(localDirection, localDirection);
    float steepest = slope - bend;
    float shallowest = slope + bend;
    if (lastHeight + steepest * toExit >= 0.0) {
      t += toExit + nudge;
      lastLeaf = kNoCell;
      continue;
    }
    bool falling = shallowest < 0.0;  // throughout: at most one root
    float safe = lastHeight / -steepest + nudge;
    float stepLength = min(toExit, falling ? lastHeight / -shallowest + nudge
                                           : max(safe, min(reach, sqrt(4.0 * lastHeight / curve))));
    vec3 localAhead = 2.0 * (at.fraction + stepLength * at.scale * direction) - 1.0;
    float ahead = side * (evaluate(at.node.offset, at.node.degree, localAhead) - offset);
    bool certain = falling || stepLength <= safe;
    if (ahead <= 0.0 && (certain || lastHeight - ahead > 0.5 * curve * stepLength * stepLength)) {
      kind = kBracketed;
      bracket = vec4(t, lastHeight, t + stepLength, ahead);
      break;
    }
    // the height sags below its chord by at most curve * length^2 / 8
    if (ahead > 0.0 && (certain || min(lastHeight, ahead) > 0.125 * curve * stepLength * stepLength)) {
      bool leaves = stepLength == toExit;
      t += leaves ? stepLength + nudge : stepLength;
      if (leaves) lastLeaf = kNoCell;
      lastHeight = ahead;
      reach = kInfinity;
    } else {
      reach = 0.25 * stepLength;
    }
  }
  if (kind == kUnderWay) bracket = vec4(lastHeight, reach, 0.0, 0.0);
  integers = uvec4(kind, floatBitsToUint(t), floatBitsToUint(side), lastLeaf);
  floats = bracket;
}
