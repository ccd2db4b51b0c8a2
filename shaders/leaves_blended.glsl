// A blended field: near a leaf's faces others have a say (core/src/field/query/blend.h).

layout(binding = 6) uniform usamplerBuffer zones;  // see FieldUpload
layout(location = 18) uniform float blend;

const int kWall = 31;
const int kDeepest = 20;

bool isNear(vec3 local) { return any(greaterThan(abs(local), vec3(1.0 - 2.0 * blend))); }

// The cells of a depth that come within `near` of their edges of the point, up to a half: one or two along each axis.
void candidates(ivec3 place, int depth, vec3 fraction, int level, float near, out ivec3 first, out ivec3 more) {
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
  first = clamp(cell - ivec3(lessThan(within, vec3(near))), ivec3(0), last);
  more = clamp(cell + ivec3(greaterThan(within, vec3(1.0 - near))), ivec3(0), last) - first;
}

// Of the leaf's nearer side along each axis: the depth of the smallest leaf that touches it.
ivec3 deepest(uint reach, vec3 local) {
  uvec3 shift = uvec3(0u, 10u, 20u) + 5u * uvec3(greaterThan(local, vec3(0.0)));
  return ivec3(uvec3(reach) >> shift & kWall);
}

// How far within that side a point is, in parts of the leaf's reach across it.
vec3 inReaches(uint reach, int depth, vec3 local) {
  ivec3 there = deepest(reach, local);
  vec3 t = (1.0 - abs(local)) * ldexp(vec3(0.5), there - depth) / blend;
  return mix(t, vec3(1.0), equal(there, ivec3(kWall)));
}

// Of the ramps, from their values' `t`, in the leaf's local coordinates.
vec3 rampSlopes(uint reach, int depth, vec3 local, vec3 t) {
  return -sign(local) * 0.75 * (1.0 - t * t) * ldexp(vec3(0.5), deepest(reach, local) - depth) / blend;
}

// The point's local coordinates in another leaf.
vec3 localIn(ivec4 other, ivec3 place, int depth, vec3 local) {
  vec3 fraction = 0.5 * local + 0.5;
  int down = other.w - depth;
  vec3 within = down >= 0 ? fraction * ldexp(1.0, down) + vec3((place << down) - other.xyz)
                          : (vec3(place - (other.xyz << -down)) + fraction) * ldexp(1.0, down);
  return 2.0 * within - 1.0;
}

// The n-th of the candidates, how many cells away from the first.
ivec3 besideOf(int n, ivec3 more) { return ivec3(n, n >> more.x, n >> (more.x + more.y)) & more; }
int numberOf(ivec3 beside) { return beside.x + 2 * beside.y + 4 * beside.z; }

// What the leaves say that reach a point: weighted, and by how much the first one differs from the others.
struct Mixture {
  vec4 first, sum, weights;  // gradients, in the local coordinates of the point's own leaf, and values
  float lowest, highest;     // of all that reach within `margin` of their reaches of the point
};

void add(inout Mixture mixture, Node leaf, ivec4 placeDepth, ivec3 place, int depth, vec3 local, float margin,
         bool withGradient) {
  bool own = placeDepth.w == depth && placeDepth.xyz == place;
  vec3 there = own ? local : localIn(placeDepth, place, depth, local);
  uint reach = texelFetch(zones, int(leaf.index)).x;
  vec3 t = inReaches(reach, placeDepth.w, there);
  if (any(lessThanEqual(t, vec3(-1.0 - margin)))) return;
  float steps = ldexp(1.0, placeDepth.w - depth);  // of the leaf's local coordinates a step of the point's own leaf's
  vec4 answer;
  if (withGradient) {
    answer = evaluateWithGradient(leaf.offset, leaf.degree, there);
    answer.xyz *= steps;
  } else {
    answer = vec4(vec3(0.0), evaluate(leaf.offset, leaf.degree, there));
  }
  mixture.lowest = min(mixture.lowest, answer.w);
  mixture.highest = max(mixture.highest, answer.w);
  t = clamp(t, vec3(-1.0), vec3(1.0));
  vec3 ramps = 0.5 + t * (0.75 - 0.25 * t * t);
  vec3 slopes = withGradient ? steps * rampSlopes(reach, placeDepth.w, there, t) : vec3(0.0);
  vec4 weight = vec4(slopes * ramps.yzx * ramps.zxy, ramps.x * ramps.y * ramps.z);
  if (!(weight.w > 0.0)) return;
  if (mixture.weights.w == 0.0) mixture.first = answer;
  vec4 difference = answer - mixture.first;
  mixture.weights += weight;
  mixture.sum += vec4(weight.xyz * difference.w + weight.w * difference.xyz, weight.w * difference.w);
}

// Which cells are near the point at each depth is told by whole numbers and the fraction within its own leaf, so that
// single precision is enough. One place where leaves are evaluated, and no array of those found: drivers unroll loops
// over such arrays, and take seconds to compile what comes of it.
Mixture mixtureAt(Node leaf, ivec3 place, int depth, vec3 local, float margin, bool withGradient) {
  Mixture mixture = Mixture(vec4(0.0), vec4(0.0), vec4(0.0), 1e30, -1e30);
  vec3 fraction = 0.5 * local + 0.5;
  bool near = isNear(local);
  uint open[8];  // the first children of internal nodes, by their number among the candidates
  ivec3 first = place, more = ivec3(0);
  bool internal = true;
  for (int level = depth; internal && level <= kDeepest; ++level) {
    ivec3 before = first, moreBefore = more;
    uint parents[8] = open;
    if (near) candidates(place, depth, fraction, level, blend * (1.0 + margin), first, more);
    internal = false;
    for (int number = 0; number < 8; ++number) open[number] = kNoCell;
    int cells = 1 << (more.x + more.y + more.z);
    for (int n = 0; n < cells; ++n) {
      ivec3 beside = besideOf(n, more);
      ivec3 cell = first + beside;
      Node node;
      int up = 0;
      if (level == depth) {
        // a node of the leaf's size, or a larger leaf, which counts for the first of the cells that it holds
        up = depth;
        node = fetchNode(baseCellIndex(uvec3(cell >> depth)));
        while (!node.leaf && up > 0) {
          --up;
          node = fetchNode(childIndex(node, uvec3(cell >> up & 1)));
        }
        if (any(greaterThan(min(beside, cell - (cell >> up << up)), ivec3(0)))) continue;
      } else {
        ivec3 parent = (cell >> 1) - before;
        if (any(lessThan(parent, ivec3(0))) || any(greaterThan(parent, moreBefore))) continue;
        uint children = parents[numberOf(parent)];
        if (children == kNoCell) continue;
        node = fetchNode(children + uint(numberOf(cell & 1)));
      }
      if (node.leaf) {
        add(mixture, node, ivec4(cell >> up, level - up), place, depth, local, margin, withGradient);
      } else {
        open[numberOf(beside)] = node.firstChild;
        internal = true;
      }
    }
  }
  return mixture;
}

// The lowest and highest also of the leaves that have a say within one of their reaches from the point.
Answer fieldAmong(Node leaf, uint depth, uvec3 place, vec3 local, float margin) {
  Mixture mixture = mixtureAt(leaf, ivec3(place), int(depth), local, margin, false);
  return Answer(mixture.first.w + mixture.sum.w / mixture.weights.w, mixture.lowest, mixture.highest);
}

float fieldValue(Node leaf, uint depth, uvec3 place, vec3 local) {
  return fieldAmong(leaf, depth, place, local, 0.0).value;
}

// Gradient with respect to the leaf's local coordinates, and value.
vec4 fieldWithGradient(Node leaf, uint depth, uvec3 place, vec3 local) {
  Mixture mixture = mixtureAt(leaf, ivec3(place), int(depth), local, 0.0, true);
  float mean = mixture.sum.w / mixture.weights.w;
  return mixture.first + vec4((mixture.sum.xyz - mean * mixture.weights.xyz) / mixture.weights.w, mean);
}

const bool kBlended = true;

Blending blendingAt(uint leaf, vec3 fraction) {
  uvec4 zone = texelFetch(zones, int(leaf));
  return Blending(isNear(2.0 * fraction - 1.0), uintBitsToFloat(zone.y), uintBitsToFloat(zone.z),
                  uintBitsToFloat(zone.w), blend);
}
