// First pass for a surface: each pixel's ray marches to the first crossing of f = offset and finds the leaf and a
// bracket of the root (docs/rendering.md, "Tracing"). A height is f - offset, signed so that it is positive where the
// ray starts. The functions for the stages have the same names as in trace.cpp.
//
// llvmpipe executes both sides of a branch. Therefore each expensive expression occurs once within the loops, with
// cheap tests before it. llvmpipe also ends all loops of a shader silently once the sum of their iterations is 65535.
// Therefore a march stops after `mostSteps`, and the pass is drawn again to continue it.

layout(location = 11) uniform int mostSteps;
layout(location = 12) uniform bool resume;       // whether to continue only the pixels whose march has not ended
layout(location = 19) uniform int blendedSteps;  // number of steps that one evaluation in a blend zone counts as
layout(location = 14) uniform float startSide;   // sign of f - offset at the start of every ray

layout(binding = 4) uniform samplerBuffer linearParts;  // a leaf's linear part: slopes in x, y, z; value at the centre

flat in float start;  // distance along the ray at which the march starts (Block::start)

#ifndef HPSDF_WEB
flat in uvec2 chosen;  // the pixels of the block whose rays are traced (Block::chosen)

bool isChosen() {
  uvec2 inBlock = uvec2(gl_FragCoord.xy) % 8u;
  return ((inBlock.y < 4u ? chosen.x : chosen.y) >> (8u * (inBlock.y % 4u) + inBlock.x) & 1u) != 0u;
}
#endif

layout(location = 0) out uvec4 integers;
layout(location = 1) out vec4 floats;

// These constants have the same values as in trace.cpp.
const float kNudge = 1e-6;     // overshoot of a step across a cell's face, and shortest step; in domain diagonals
const float kPastFace = 4e-7;  // lengthToExit ends this far behind a face, as a share of the domain's extent
const float kGrain = 0.25;     // least length of a step in a blend zone, as a share of the blend extent

const float kBack = 16.0;      // an exact leaf's triangles are looked for so far behind t, in nudges
const float kClear = 1e-3;     // sine of the least angle at which a ray counts as not parallel to a triangle

const float kInfinity = 1e30;

struct MarchRay {
  vec3 origin, direction;
  vec3 world;    // unit direction in world coordinates
  vec3 inverse;  // 1 / |direction| for each axis; infinite for an axis along which the ray does not move
  float length;
  float nudge;  // the length kNudge in world units
};

struct March {
  uint kind;
  float t;
  float side;         // the sign of f - offset where the ray starts, or 0 while it is unknown
  uint lastLeaf;      // the leaf that the last step did not leave, or kNoCell
  float lastHeight;   // height of lastLeaf's polynomial at t, or an upper bound if the height falls in the whole leaf
  float longestStep;  // the longest step to try next in lastLeaf
  vec4 bracket;
  int steps;
  uint zoneLeaf;   // the leaf to which zoneStep applies
  float zoneStep;  // length of the next step in the blend zone of zoneLeaf
};

// The node that contains the ray's point at parameter t, with bounds along the ray for the height (f - offset, signed).
struct LeafPoint {
  CellPoint at;
  BlendZone zone;
  vec3 localDirection;   // change of the local coordinates per world unit
  float toLeave;         // length along the ray to the exit from the node
  float middle, slope;   // height of the polynomial's linear part at t, and its slope along the ray
  float lowest, highest;  // lower and upper bound of the height at t
  float slopeDeviation;   // greatest difference between the slopes of the height and of its linear part
  bool known;             // whether lastHeight is the height of the leaf's polynomial at t
  float steepestOfAll;    // lower bound of the slopes of all polynomials that are blended at t
};

// The length along the ray, in world units, from a point to just behind the face where the ray leaves the point's node.
// With a margin, the node is first shrunk on every side by `margin` times its edge length.
float lengthToExit(CellPoint at, MarchRay ray, float margin) {
  vec3 ahead = mix(at.fraction, 1.0 - at.fraction, greaterThan(ray.direction, vec3(0.0))) - margin;
  vec3 exits = mix((ahead / at.scale + kPastFace * vec3(grid)) * ray.inverse, vec3(kInfinity),
                   equal(ray.direction, vec3(0.0)));
  return min(exits.x, min(exits.y, exits.z));
}

// Returns the length of a step along the ray over which `height` is certain to stay positive. `steepest` is a lower
// bound of the height's slope along the ray.
float certainlyAbove(float height, float steepest) {
  return height > 0.0 ? (steepest < 0.0 ? height / -steepest : kInfinity) : 0.0;
}

// Descends to the leaf at a point, but stops earlier at a node whose range of field values excludes the offset.
CellPoint relevantNodeAt(vec3 p) {
  CellPoint at = baseCellAt(p);
  while (!at.node.leaf && at.node.lo <= offset && at.node.hi >= offset) descend(at);
  return at;
}

March startMarch(Ray ray, MarchRay marchRay) {
  March march;
  march.t = max(0.0, float(double(start) - ray.fromEye) - 4.0 * marchRay.nudge);
  march.side = march.t > 0.0 ? startSide : 0.0;
  march.lastLeaf = kNoCell;
  march.lastHeight = 0.0;
  march.longestStep = 0.0;
  march.kind = kUnderWay;
  march.bracket = vec4(0.0);
  if (resume) {
    uvec4 before = texelFetch(stateIntegers, ivec2(gl_FragCoord.xy), 0);
    vec4 last = texelFetch(stateFloats, ivec2(gl_FragCoord.xy), 0);
#ifdef HPSDF_WEB
    // WebGL does not let a pass read what it draws into. The state of a march that has ended is copied.
    march.kind = before.x;
    march.bracket = last;
#else
    if (before.x != kUnderWay) discard;
#endif
    march.t = uintBitsToFloat(before.y);
    march.side = uintBitsToFloat(before.z);
    march.lastLeaf = before.w;
    march.lastHeight = last.x;
    march.longestStep = last.y;
  }
  if (march.kind == kUnderWay && !(march.t <= marchRay.length)) march.kind = kMiss;
  march.steps = 0;
  march.zoneLeaf = kNoCell;
  march.zoneStep = 0.0;
  return march;
}

// The distance from the centre of a leaf to the farther end of the ray's part from t to the leaf's exit. The distance from
// the centre bounds the change of an exact distance.
float farthestFromCentre(LeafPoint leaf) {
  vec3 here = 2.0 * leaf.at.fraction - 1.0;
  vec3 there = here + leaf.toLeave * leaf.localDirection;
  vec3 toWorld = halfCell(leaf.at.depth);
  return max(length(here * toWorld), length(there * toWorld));
}

// Finds the node at parameter t of the ray and bounds the height there. Also sets march.side if it is unknown and the
// bounds prove the sign.
LeafPoint boundHeight(MarchRay ray, inout March march) {
  LeafPoint leaf;
  leaf.at = relevantNodeAt(ray.origin + march.t * ray.direction);
  leaf.toLeave = lengthToExit(leaf.at, ray, 0.0);
  leaf.localDirection = 2.0 * leaf.at.scale * ray.direction;
  // Bound f - offset in the node at t.
  leaf.middle = 0.0;
  leaf.slope = 0.0;
  leaf.lowest = leaf.at.node.lo - offset;
  leaf.highest = leaf.at.node.hi - offset;
  leaf.zone = BlendZone(false, 0.0, 0.0, 0.0, 0.0);
  if (leaf.at.node.leaf) {
    leaf.zone = blendZoneAt(leaf.at.node.index, leaf.at.fraction);
    vec4 linear = texelFetch(linearParts, int(leaf.at.node.index));
    leaf.middle = dot(linear.xyz, 2.0 * leaf.at.fraction - 1.0) + (linear.w - offset);
    leaf.slope = dot(linear.xyz, leaf.localDirection);
    float deviation = leaf.at.node.valueDeviation;
    if (isExact(leaf.at.node)) deviation = min(deviation, farthestFromCentre(leaf) + kNudge * diagonal);
    leaf.lowest = leaf.middle - deviation - leaf.zone.valueDifference;
    leaf.highest = leaf.middle + deviation + leaf.zone.valueDifference;
  }
  // Find the sign of f - offset at the ray's start. If it is negative, negate the bounds, because a height is positive
  // at the start of the ray.
  if (march.side == 0.0) march.side = leaf.lowest > 0.0 ? 1.0 : leaf.highest < 0.0 ? -1.0 : 0.0;
  if (march.side < 0.0) {
    float negated = -leaf.lowest;
    leaf.lowest = -leaf.highest;
    leaf.highest = negated;
    leaf.middle = -leaf.middle;
    leaf.slope = -leaf.slope;
  }
  leaf.slopeDeviation = leaf.at.node.gradientDeviation * length(leaf.localDirection);
  leaf.known = leaf.at.node.index == march.lastLeaf;
  leaf.steepestOfAll = 0.0;
  return leaf;
}

// Returns true if the ray may cross the surface within the node. Otherwise moves t to the exit from the node or, if the
// node lies behind the surface, records a hit on the face where the ray enters the node.
bool passNode(MarchRay ray, LeafPoint leaf, inout March march) {
  bool above = (leaf.lowest > 0.0 && leaf.lowest + leaf.slope * leaf.toLeave > 0.0) ||
               (leaf.known && march.lastHeight - leaf.zone.valueDifference +
                                      (leaf.slope - leaf.slopeDeviation) * leaf.toLeave >=
                                  0.0);
  if (march.side != 0.0 && leaf.highest < 0.0) {
    march.kind = kOnFace;
    return false;
  }
  if (march.side != 0.0 && above) {
    march.t += leaf.toLeave + ray.nudge;
    march.lastLeaf = kNoCell;
    if (!(march.t <= ray.length)) march.kind = kMiss;
    return false;
  }
  return true;
}

// Stores the polynomial's value at t as the first height in a leaf. Returns true if only the blended field can tell on
// which side of the surface the ray starts.
bool enterLeaf(LeafPoint leaf, float value, float lower, inout March march) {
  bool undecided = leaf.zone.inside && march.side == 0.0 && abs(value) <= lower;
  if (march.side == 0.0 && !undecided) march.side = value >= 0.0 ? 1.0 : -1.0;
  march.lastLeaf = leaf.at.node.index;
  march.lastHeight = march.side * value;
  march.longestStep = kInfinity;
  if (march.lastHeight < -lower) march.kind = kOnFace;
  return undecided;
}

// Tries a step to a point with the height `ahead`. Sets the bracket if the ray provably crosses the surface once before
// this point. Moves t to the point if the ray provably does not cross. Else shortens the next step. Over a step, the
// height sags below its chord by at most curve * length^2 / 8, and it is monotone if it falls by more than
// curve * length^2 / 2.
void advance(MarchRay ray, LeafPoint leaf, float stepLength, float ahead, float lower, float curve, bool certain,
             inout March march) {
  float clear = march.lastHeight - lower;
  if (!leaf.zone.inside && ahead <= 0.0 &&
      (certain || march.lastHeight - ahead > 0.5 * curve * stepLength * stepLength)) {
    march.kind = kBracketed;
    march.bracket = vec4(march.t, march.t + stepLength,
                         march.t + stepLength * march.lastHeight / (march.lastHeight - ahead), 0.0);
  } else if (certain || min(clear, ahead - lower) > 0.125 * curve * stepLength * stepLength) {
    bool leaves = stepLength == leaf.toLeave;
    march.t += leaves ? stepLength + ray.nudge : stepLength;
    if (leaves) march.lastLeaf = kNoCell;
    march.lastHeight = ahead;
    march.longestStep = kInfinity;
    if (!(march.t <= ray.length)) march.kind = kMiss;
  } else {
    march.longestStep = 0.25 * stepLength;
  }
}

// Takes a step along the ray by one leaf's polynomial. Returns true if the blended field has to be evaluated instead.
bool stepInLeaf(MarchRay ray, inout LeafPoint leaf, inout March march) {
  float curve = leaf.at.node.secondDerivative * dot(leaf.localDirection, leaf.localDirection);
  float steepest = leaf.slope - leaf.slopeDeviation;
  float shallowest = leaf.slope + leaf.slopeDeviation;
  float toExit = leaf.toLeave;  // length to the exit from the leaf, or from the leaf's part without blending
  if (kBlended && !leaf.zone.inside) toExit = lengthToExit(leaf.at, ray, leaf.zone.width);
  bool falling = !leaf.zone.inside && shallowest < 0.0;  // the height decreases in the whole leaf: at most one root
  if (march.side != 0.0 && falling && leaf.lowest > 0.0) {
    if (leaf.highest + leaf.slope * toExit < 0.0) {
      march.kind = kBracketed;
      march.bracket = vec4(march.t, march.t, march.t, 0.0) + vec4(leaf.lowest, leaf.highest, leaf.middle, 0.0) / -leaf.slope;
      return false;
    }
    if (!leaf.known) {
      // For a falling height, an upper bound serves as well as the height itself.
      leaf.known = true;
      march.lastHeight = leaf.highest;
      march.lastLeaf = leaf.at.node.index;
    }
  }
  float lower = leaf.zone.inside ? leaf.zone.valueDifference : 0.0;  // greatest excess of the polynomial over the field
  float clear = march.lastHeight - lower;
  float safe = certainlyAbove(clear, steepest) + ray.nudge;
  leaf.steepestOfAll = steepest - leaf.zone.gradientDifference * length(leaf.localDirection);
  if (leaf.zone.inside && leaf.known && safe * length(leaf.localDirection) < leaf.zone.extent) return true;
  float stepLength = min(toExit, falling ? march.lastHeight / -shallowest + ray.nudge
                                         : max(safe, min(march.longestStep, sqrt(4.0 * max(clear, 0.0) / curve))));
  if (!leaf.known) stepLength = 0.0;
  vec3 localAhead = 2.0 * (leaf.at.fraction + stepLength * leaf.at.scale * ray.direction) - 1.0;
  float value = leafValue(leaf.at.node, leaf.at.depth, cellIndexOf(leaf.at), localAhead) - offset;
  if (!leaf.known) return enterLeaf(leaf, value, lower, march);
  advance(ray, leaf, stepLength, march.side * value, lower, curve, falling || stepLength <= safe, march);
  return false;
}

// Follows the ray to the first triangle that it crosses in an exact leaf, or to the end of the leaf or of its part without
// blending. Where the ray first crosses a triangle to the side on which it is already, it has crossed the surface at the
// face. Rays parallel to a triangle do not tell that, because of rounding.
void crossExactLeaf(MarchRay ray, LeafPoint leaf, inout March march) {
  float toExit = kBlended ? lengthToExit(leaf.at, ray, leaf.zone.width) : leaf.toLeave;
  Crossings found = crossingsOf(leaf.at.node, worldOf(ray.origin + march.t * ray.direction), ray.world,
                                -min(march.t, kBack * ray.nudge), toExit + ray.nudge);
  float rule = float(constantSign(leaf.at.node));
  if (rule != 0.0) {
    found.fromOutside = kNever;
    found.fromInside = kNever;
  }
  float first = min(found.fromOutside, found.fromInside);
  if (march.side == 0.0) march.side = rule != 0.0 || first == kNever ? rule : found.fromOutside == first ? 1.0 : -1.0;
  bool outer = march.side > 0.0;
  float entry = outer ? found.fromOutside : found.fromInside;
  bool behind = first > 2.0 * ray.nudge && first < entry - 2.0 * ray.nudge &&
                abs(dot(ray.world, normalOf(outer ? found.inner : found.outer))) > kClear;
  if (march.side != 0.0 && (behind || rule == -march.side)) {
    march.kind = kOnFace;
  } else if (entry < kNever) {
    march.kind = kOnTriangle;
    march.lastLeaf = outer ? found.outer : found.inner;
    march.bracket.x = entry;
  } else {
    march.t += toExit + ray.nudge;
    march.lastLeaf = kNoCell;
    if (!(march.t <= ray.length)) march.kind = kMiss;
  }
}

// Follows the ray to the surface in an exact leaf whose triangles intersect each other. Such triangles are no part of the
// surface where they lie inside: a crossing counts if the sign changes behind it.
void crossIntersectingTriangles(MarchRay ray, LeafPoint leaf, inout March march) {
  const int kMostCrossings = 16;
  float toExit = kBlended ? lengthToExit(leaf.at, ray, leaf.zone.width) : leaf.toLeave;
  vec3 start = worldOf(ray.origin + march.t * ray.direction);
  float clear = 2.0 * ray.nudge;
  if (march.side == 0.0) march.side = float(signFromWinding(leaf.at.node, start));
  float from = -min(march.t, kBack * ray.nudge);
  for (int i = 0; i < kMostCrossings; ++i) {
    Crossings found = crossingsOf(leaf.at.node, start, ray.world, from, toExit + ray.nudge);
    bool outer = march.side > 0.0;
    float entry = outer ? found.fromOutside : found.fromInside;
    bool isBehind = i == 0 && entry > clear && float(signFromWinding(leaf.at.node, start + clear * ray.world)) == -march.side;
    if (isBehind) march.kind = kOnFace;
    if (isBehind || entry == kNever) break;
    if (float(signFromWinding(leaf.at.node, start + (entry + clear) * ray.world)) == -march.side) {
      march.kind = kOnTriangle;
      march.lastLeaf = outer ? found.outer : found.inner;
      march.bracket.x = entry;
      break;
    }
    from = entry + clear;
  }
  if (march.kind != kUnderWay) return;
  march.t += toExit + ray.nudge;
  march.lastLeaf = kNoCell;
  if (!(march.t <= ray.length)) march.kind = kMiss;
}

// Marches along the ray, using the functions of single leaves. Returns true if the ray reaches a point at which the
// blended field has to be evaluated. Then `leaf` is the leaf at this point.
bool marchByPolynomials(MarchRay ray, inout March march, out LeafPoint leaf) {
  bool blended = false;
  while (!blended && march.kind == kUnderWay && march.steps < mostSteps) {
    bool stays = false;
    while (!stays && march.kind == kUnderWay && march.steps < mostSteps) {
      ++march.steps;
      leaf = boundHeight(ray, march);
      stays = passNode(ray, leaf, march);
    }
    if (!stays) break;
    if (kExactLeaves && crossesAtTriangles(leaf.at.node) && !leaf.zone.inside) {
      if (signByWinding(leaf.at.node)) {
        crossIntersectingTriangles(ray, leaf, march);
      } else {
        crossExactLeaf(ray, leaf, march);
      }
      continue;
    }
    blended = stepInLeaf(ray, leaf, march);
  }
  return blended;
}

// Takes a step along the ray, using the blended field. The step goes as far as the height is guaranteed to stay
// positive, but at least a small part of the blend zone. In a new leaf, the field is first evaluated at t itself.
void stepInBlendZone(MarchRay ray, LeafPoint leaf, inout March march) {
  march.steps += blendedSteps;
  float stepLength = leaf.at.node.index == march.zoneLeaf ? min(leaf.toLeave, march.zoneStep) : 0.0;
  vec3 localAhead = 2.0 * (leaf.at.fraction + stepLength * leaf.at.scale * ray.direction) - 1.0;
  FieldRange ahead = blendedRange(leaf.at.node, leaf.at.depth, cellIndexOf(leaf.at), localAhead, 1.0);
  float height = ahead.value - offset;
  march.lastLeaf = kNoCell;
  if (march.side == 0.0) march.side = height >= 0.0 ? 1.0 : -1.0;
  height *= march.side;
  if (height < 0.0 && stepLength == 0.0) {
    march.kind = kOnFace;
  } else if (height <= 0.0) {
    march.kind = kBracketed;
    march.bracket = vec4(march.t, march.t + stepLength, march.t + 0.5 * stepLength, 0.0);
  } else {
    march.t += stepLength == leaf.toLeave ? stepLength + ray.nudge : stepLength;
    if (!(march.t <= ray.length)) march.kind = kMiss;
  }
  // Choose the length of the next step: so short that the heights of all polynomials that may be blended stay positive,
  // but at least kGrain blend extents.
  float lowest = march.side > 0.0 ? ahead.lowest - offset : offset - ahead.highest;
  float extent = leaf.zone.extent / length(leaf.localDirection);
  march.zoneStep = max(kGrain * extent, min(extent, certainlyAbove(lowest, leaf.steepestOfAll))) + ray.nudge;
  march.zoneLeaf = leaf.at.node.index;
}

void main() {
  Ray pixel = pixelRay();
  MarchRay ray;
  ray.origin = vec3(pixel.origin);
  ray.direction = vec3(pixel.direction);
  ray.world = vec3(pixel.worldDirection);
  ray.inverse = abs(1.0 / ray.direction);
  ray.length = float(pixel.length);
  ray.nudge = kNudge * diagonal;
  March march = startMarch(pixel, ray);
#ifndef HPSDF_WEB
  if (!isChosen()) march.kind = kMiss;
#endif
  while (march.kind == kUnderWay && march.steps < mostSteps) {
    LeafPoint leaf;
    bool blended = marchByPolynomials(ray, march, leaf);
    if (kBlended && blended) stepInBlendZone(ray, leaf, march);
  }
  if (march.kind == kUnderWay) march.bracket = vec4(march.lastHeight, march.longestStep, 0.0, 0.0);
  integers = uvec4(march.kind, floatBitsToUint(march.t), floatBitsToUint(march.side), march.lastLeaf);
  floats = march.bracket;
}
