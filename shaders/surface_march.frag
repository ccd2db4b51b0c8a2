// First pass of a surface: up to the leaf and the bracket of the first crossing of f = offset (docs/rendering.md,
// "Tracing"). llvmpipe runs both sides of a branch: what is dear stands in the loops once, and what is cheap before it.
// After `mostSteps` a pixel is left under way and the pass drawn again: llvmpipe ends all loops of a shader without a
// word once they have run 65535 times together.

layout(location = 11) uniform int mostSteps;
layout(location = 12) uniform bool resume;      // draw again: takes up the pixels under way, leaves the others
layout(location = 19) uniform int togetherSteps;  // what an evaluation of the field where others have a say counts for
layout(location = 14) uniform float startSide;  // SurfaceBlocks::side

layout(binding = 4) uniform samplerBuffer linearParts;  // of leaves: slopes in local x, y, z, value in the middle

flat in float start;  // of the block: see SurfaceBlocks

layout(location = 0) out uvec4 integers;
layout(location = 1) out vec4 floats;

const float kNudge = 1e-6;  // in domain diagonals: beyond a face; also the shortest step; as in trace.cpp

const float kPastFace = 4e-7;  // of the grid; as in trace.cpp

const float kInfinity = 1e30;

const float kGrain = 0.25;  // as in trace.cpp

// World length from the point to where the ray has left the node's box, or that within it whose faces are `margin` of
// its edges inside, past a face by a little: see trace.cpp.
// `inverse`: of the absolute direction, infinite for an axis along which the ray does not move.
float lengthToExit(CellPoint at, vec3 direction, vec3 inverse, float margin) {
  vec3 ahead = mix(at.fraction, 1.0 - at.fraction, greaterThan(direction, vec3(0.0))) - margin;
  vec3 exits = mix((ahead / at.scale + kPastFace * vec3(grid)) * inverse, vec3(kInfinity), equal(direction, vec3(0.0)));
  return min(exits.x, min(exits.y, exits.z));
}

// How far along the ray a height stays above zero at least that falls no steeper than `steepest`.
float certainlyAbove(float height, float steepest) {
  return height > 0.0 ? (steepest < 0.0 ? height / -steepest : kInfinity) : 0.0;
}

// Down to a leaf, or to a node whose range excludes the offset.
CellPoint relevantNodeAt(vec3 p) {
  CellPoint at = baseCellAt(p);
  while (!at.node.leaf && at.node.lo <= offset && at.node.hi >= offset) descend(at);
  return at;
}

void main() {
  Ray ray = pixelRay();
  vec3 origin = vec3(ray.origin);
  vec3 direction = vec3(ray.direction);
  vec3 inverse = abs(1.0 / direction);
  float rayLength = float(ray.length);
  float nudge = kNudge * diagonal;

  float t = max(0.0, float(double(start) - ray.fromEye) - 4.0 * nudge);
  // of the surface, on which the ray starts, or 0: not known yet. The height above the surface is side * (f - offset)
  float side = t > 0.0 ? startSide : 0.0;
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
  uint kind = t <= rayLength ? kUnderWay : kMiss;
  vec4 bracket = vec4(0.0);

  // where others have a say: the next step, and the leaf that it holds for
  uint togetherLeaf = kNoCell;
  float togetherLength = 0.0;

  int step = 0;
  while (kind == kUnderWay && step < mostSteps) {
    CellPoint at;
    Blending blending;
    vec3 localDirection;
    float toLeave = 0.0;  // the leaf
    // by the leaves' own polynomials, up to where others have a say in whether the field is zero
    bool together = false;
    float steepestOfAll = 0.0;  // slope along the ray of what any leaf says that has a say
    while (!together && kind == kUnderWay && step < mostSteps) {
      // on through all nodes of which the bounds alone say that nothing is crossed in them
      // the height's linear part at t and its slope; the height at t lies between the next two, its slope within +-bend
      float middle = 0.0, slope = 0.0, lowest = 0.0, highest = 0.0, bend = 0.0;
      bool known = false;  // the height of the leaf's polynomial at t
      bool stays = false;
      while (!stays && kind == kUnderWay && step < mostSteps) {
        ++step;
        at = relevantNodeAt(origin + t * direction);
        toLeave = lengthToExit(at, direction, inverse, 0.0);
        localDirection = 2.0 * at.scale * direction;
        // of f - offset at first
        middle = 0.0;
        slope = 0.0;
        lowest = at.node.lo - offset;
        highest = at.node.hi - offset;
        blending = Blending(false, 0.0, 0.0, 0.0, 0.0);
        if (at.node.leaf) {
          blending = blendingAt(at.node.index, at.fraction);
          vec4 linear = texelFetch(linearParts, int(at.node.index));
          middle = dot(linear.xyz, 2.0 * at.fraction - 1.0) + (linear.w - offset);
          slope = dot(linear.xyz, localDirection);
          lowest = middle - at.node.rest - blending.apart;
          highest = middle + at.node.rest + blending.apart;
        }
        if (side == 0.0) side = lowest > 0.0 ? 1.0 : highest < 0.0 ? -1.0 : 0.0;
        if (side < 0.0) {
          float negated = -lowest;
          lowest = -highest;
          highest = negated;
          middle = -middle;
          slope = -slope;
        }
        bend = at.node.bend * length(localDirection);
        known = at.node.index == lastLeaf;
        if (side != 0.0 && highest < 0.0) {
          kind = kOnFace;
        } else if (side != 0.0 && ((lowest > 0.0 && lowest + slope * toLeave > 0.0) ||
                                   (known && lastHeight - blending.apart + (slope - bend) * toLeave >= 0.0))) {
          t += toLeave + nudge;
          lastLeaf = kNoCell;
          if (!(t <= rayLength)) kind = kMiss;
        } else {
          stays = true;
        }
      }
      if (!stays) break;

      // within this leaf the slope of its polynomial's height along the ray lies between these two, its second
      // derivative in +-curve
      float curve = at.node.curve * dot(localDirection, localDirection);
      float steepest = slope - bend;
      float shallowest = slope + bend;
      float toExit = toLeave;  // of where the bounds hold for the field
      if (kBlended && !blending.near) toExit = lengthToExit(at, direction, inverse, blending.width);
      bool falling = !blending.near && shallowest < 0.0;  // throughout: at most one root
      if (side != 0.0 && falling && lowest > 0.0) {
        if (highest + slope * toExit < 0.0) {
          kind = kBracketed;
          bracket = vec4(t, t, t, 0.0) + vec4(lowest, highest, middle, 0.0) / -slope;
          break;
        }
        if (!known) {
          // a height that is no smaller will do
          known = true;
          lastHeight = highest;
          lastLeaf = at.node.index;
        }
      }
      // the field is no lower than this much below the polynomial
      float lower = blending.near ? blending.apart : 0.0;
      float clear = lastHeight - lower;
      float safe = certainlyAbove(clear, steepest) + nudge;
      steepestOfAll = steepest - blending.twist * length(localDirection);
      together = blending.near && known && safe * length(localDirection) < blending.reach;
      if (together) break;
      float stepLength = min(toExit, falling ? lastHeight / -shallowest + nudge
                                             : max(safe, min(reach, sqrt(4.0 * max(clear, 0.0) / curve))));
      if (!known) stepLength = 0.0;
      vec3 localAhead = 2.0 * (at.fraction + stepLength * at.scale * direction) - 1.0;
      float value = evaluate(at.node.offset, at.node.degree, localAhead) - offset;
      if (!known) {
        together = blending.near && side == 0.0 && abs(value) <= lower;
        if (side == 0.0 && !together) side = value >= 0.0 ? 1.0 : -1.0;
        lastLeaf = at.node.index;
        lastHeight = side * value;
        reach = kInfinity;
        if (lastHeight < -lower) kind = kOnFace;
      } else {
        float ahead = side * value;
        bool certain = falling || stepLength <= safe;
        if (!blending.near && ahead <= 0.0 &&
            (certain || lastHeight - ahead > 0.5 * curve * stepLength * stepLength)) {
          kind = kBracketed;
          bracket = vec4(t, t + stepLength, t + stepLength * lastHeight / (lastHeight - ahead), 0.0);
        } else if (certain || min(clear, ahead - lower) > 0.125 * curve * stepLength * stepLength) {
          // the height sags below its chord by at most curve * length^2 / 8
          bool leaves = stepLength == toLeave;
          t += leaves ? stepLength + nudge : stepLength;
          if (leaves) lastLeaf = kNoCell;
          lastHeight = ahead;
          reach = kInfinity;
          if (!(t <= rayLength)) kind = kMiss;
        } else {
          reach = 0.25 * stepLength;
        }
      }
    }

    if (kBlended && together) {
      step += togetherSteps;
      float stepLength = at.node.index == togetherLeaf ? min(toLeave, togetherLength) : 0.0;
      vec3 localAhead = 2.0 * (at.fraction + stepLength * at.scale * direction) - 1.0;
      Answer ahead = fieldAmong(at.node, at.depth, placeOf(at), localAhead, 1.0);
      float height = ahead.value - offset;
      lastLeaf = kNoCell;
      if (side == 0.0) side = height >= 0.0 ? 1.0 : -1.0;
      height *= side;
      if (height < 0.0 && stepLength == 0.0) {
        kind = kOnFace;
      } else if (height <= 0.0) {
        kind = kBracketed;
        bracket = vec4(t, t + stepLength, t + 0.5 * stepLength, 0.0);
      } else {
        t += stepLength == toLeave ? stepLength + nudge : stepLength;
        if (!(t <= rayLength)) kind = kMiss;
      }
      // no leaf that will have a say within its reach falls to zero before
      float lowest = side > 0.0 ? ahead.lowest - offset : offset - ahead.highest;
      float reachLength = blending.reach / length(localDirection);
      togetherLength = max(kGrain * reachLength, min(reachLength, certainlyAbove(lowest, steepestOfAll))) + nudge;
      togetherLeaf = at.node.index;
    }
  }
  if (kind == kUnderWay) bracket = vec4(lastHeight, reach, 0.0, 0.0);
  integers = uvec4(kind, floatBitsToUint(t), floatBitsToUint(side), lastLeaf);
  floats = bracket;
}
