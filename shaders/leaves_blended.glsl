// A blended field: near a leaf's faces others have a say (core/src/field/blend.h).

layout(binding = 6) uniform usamplerBuffer zones;  // see FieldUpload
layout(location = 18) uniform float blend;

const uint kWall = 31u;
const int kDeepest = 20;

// The leaves that reach a point. Which cells are near it at each depth is told by whole numbers and the fraction
// within its own leaf, so that single precision is enough.
struct Reaching {
  int count;
  uint index[8];
  ivec4 placeDepth[8];  // as of the point's own leaf
};

bool isNear(vec3 local) { return any(greaterThan(abs(local), vec3(1.0 - 2.0 * blend))); }

// The cells of a depth that come within `blend` of their edges of the point: one or two along each axis.
void candidates(ivec3 place, int depth, vec3 fraction, int level, out ivec3 first, out ivec3 more) {
  ivec3 cell;
  vec3 within;
  if (level <= depth) {
    int up = depth - level;
    cell = place >> up;
    within = (vec3(place - (cell << up)) + fraction) * ldexp(1.0, -up);
  } else {
    int down = level - depth;
    within = fraction * ldexp(1.0, down);
    ivec3 whole = ivec3(floor(within));
    cell = (place << down) + whole;
    within -= vec3(whole);
  }
  ivec3 last = (ivec3(grid) << level) - 1;
  first = clamp(cell - ivec3(lessThan(within, vec3(blend))), ivec3(0), last);
  more = clamp(cell + ivec3(greaterThan(within, vec3(1.0 - blend))), ivec3(0), last) - first;
}

// In the leaf's local coordinates, from which `steps` takes gradients to those of the point's own leaf.
void rampsOf(uint reach, int depth, vec3 local, out vec3 value, out vec3 slope) {
  for (int axis = 0; axis < 3; ++axis) {
    bool upper = local[axis] > 0.0;
    uint deepest = reach >> (10 * axis + (upper ? 5 : 0)) & kWall;
    float scale = 0.5 * ldexp(1.0, int(deepest) - depth) / blend;
    float t = deepest == kWall ? 1.0 : clamp((1.0 - abs(local[axis])) * scale, -1.0, 1.0);
    value[axis] = 0.5 + t * (0.75 - 0.25 * t * t);
    slope[axis] = (upper ? -0.75 : 0.75) * (1.0 - t * t) * scale;
  }
}

// The point's local coordinates in another leaf.
vec3 localIn(ivec4 other, ivec3 place, int depth, vec3 local) {
  vec3 fraction = 0.5 * local + 0.5;
  int down = other.w - depth;
  vec3 within = down >= 0 ? fraction * ldexp(1.0, down) + vec3((place << down) - other.xyz)
                          : (vec3(place - (other.xyz << -down)) + fraction) * ldexp(1.0, down);
  return 2.0 * within - 1.0;
}

Reaching reaching(ivec3 place, int depth, vec3 local) {
  vec3 fraction = 0.5 * local + 0.5;
  Reaching found;
  found.count = 0;
  uint open[8];  // the first children of internal nodes, by their number among the candidates
  ivec3 before, moreBefore;
  bool any = true;
  for (int level = 0; any && level <= kDeepest; ++level) {
    ivec3 first, more;
    candidates(place, depth, fraction, level, first, more);
    uint next[8];
    any = false;
    for (int number = 0; number < 8; ++number) {
      next[number] = kNoCell;
      ivec3 beside = ivec3(number & 1, number >> 1 & 1, number >> 2);
      ivec3 cell = first + beside;
      bool exists = all(lessThanEqual(beside, more));
      uint index = baseCellIndex(uvec3(cell));
      if (level > 0) {
        ivec3 parent = (cell >> 1) - before;
        exists = exists && all(greaterThanEqual(parent, ivec3(0))) && all(lessThanEqual(parent, moreBefore));
        uint children = exists ? open[parent.x + 2 * parent.y + 4 * parent.z] : kNoCell;
        exists = children != kNoCell;
        index = children + uint((cell.x & 1) + 2 * (cell.y & 1) + 4 * (cell.z & 1));
      }
      if (!exists) continue;
      Node node = fetchNode(index);
      if (node.leaf) {
        vec3 ramps, slopes;
        vec3 there = localIn(ivec4(cell, level), place, depth, local);
        rampsOf(texelFetch(zones, 2 * int(index)).x, level, there, ramps, slopes);
        // of more than eight that are near, no more reach the point
        if (found.count == 8 || !(ramps.x * ramps.y * ramps.z > 0.0)) continue;
        found.index[found.count] = index;
        found.placeDepth[found.count] = ivec4(cell, level);
        ++found.count;
      } else {
        next[number] = node.firstChild;
        any = true;
      }
    }
    open = next;
    before = first;
    moreBefore = more;
  }
  return found;
}

Reaching leavesNear(Node leaf, uint depth, uvec3 place, vec3 local) {
  if (isNear(local)) return reaching(ivec3(place), int(depth), local);
  Reaching alone;
  alone.count = 1;
  alone.index[0] = leaf.index;
  alone.placeDepth[0] = ivec4(ivec3(place), int(depth));
  return alone;
}

float fieldValue(Node leaf, uint depth, uvec3 place, vec3 local) {
  Reaching near = leavesNear(leaf, depth, place, local);
  float first = 0.0, weights = 0.0, sum = 0.0;
  for (int i = 0; i < near.count; ++i) {
    ivec4 other = near.placeDepth[i];
    vec3 there = other.w == int(depth) && other.xyz == ivec3(place) ? local
                                                                     : localIn(other, ivec3(place), int(depth), local);
    vec3 ramps, slopes;
    rampsOf(texelFetch(zones, 2 * int(near.index[i])).x, other.w, there, ramps, slopes);
    float weight = ramps.x * ramps.y * ramps.z;
    if (!(weight > 0.0)) continue;
    Node node = fetchNode(near.index[i]);
    float value = evaluate(node.offset, node.degree, there);
    if (weights == 0.0) first = value;
    weights += weight;
    sum += weight * (value - first);
  }
  return first + sum / weights;
}

// Gradient with respect to the leaf's local coordinates, and value.
vec4 fieldWithGradient(Node leaf, uint depth, uvec3 place, vec3 local) {
  Reaching near = leavesNear(leaf, depth, place, local);
  vec4 first = vec4(0.0), sum = vec4(0.0), weights = vec4(0.0);
  for (int i = 0; i < near.count; ++i) {
    ivec4 other = near.placeDepth[i];
    vec3 there = other.w == int(depth) && other.xyz == ivec3(place) ? local
                                                                     : localIn(other, ivec3(place), int(depth), local);
    float steps = ldexp(1.0, other.w - int(depth));  // of the other's local coordinates a step of this leaf's
    vec3 ramps, slopes;
    rampsOf(texelFetch(zones, 2 * int(near.index[i])).x, other.w, there, ramps, slopes);
    vec4 weight = vec4(steps * slopes * ramps.yzx * ramps.zxy, ramps.x * ramps.y * ramps.z);
    if (!(weight.w > 0.0)) continue;
    Node node = fetchNode(near.index[i]);
    vec4 result = evaluateWithGradient(node.offset, node.degree, there);
    result.xyz *= steps;
    if (weights.w == 0.0) first = result;
    vec4 difference = result - first;
    weights += weight;
    sum += vec4(weight.xyz * difference.w + weight.w * difference.xyz, weight.w * difference.w);
  }
  float mean = sum.w / weights.w;
  return first + vec4((sum.xyz - mean * weights.xyz) / weights.w, mean);
}

// The leaf with bounds that hold for the blended field, from a point up to where `aheadNear` says.
Node boundsNear(Node leaf, vec3 fraction) {
  bvec3 near = greaterThan(abs(2.0 * fraction - 1.0), vec3(1.0 - 2.0 * blend));
  int axes = int(near.x) + int(near.y) + int(near.z);
  uvec4 one = texelFetch(zones, 2 * int(leaf.index));
  leaf.rest += uintBitsToFloat(one.y);
  if (axes == 0) return leaf;
  uvec4 more = texelFetch(zones, 2 * int(leaf.index) + 1);
  leaf.bend += uintBitsToFloat(axes == 1 ? one.z : axes == 2 ? more.x : more.z);
  leaf.curve += uintBitsToFloat(axes == 1 ? one.w : axes == 2 ? more.y : more.w);
  return leaf;
}

// How far the leaf's faces, or the planes where its zones begin or end, are ahead along each axis, in parts of its edges.
vec3 aheadNear(vec3 fraction, bvec3 forwards) {
  vec3 along = mix(1.0 - fraction, fraction, forwards);
  vec3 next = mix(mix(vec3(1.0), vec3(1.0 - blend), lessThan(along, vec3(1.0 - blend))), vec3(blend),
                  lessThan(along, vec3(blend)));
  return next - along;
}
