// The field with blending (core/src/field/query/blend.h): near the faces of a leaf the field is the weighted
// mean of the functions of several leaves: their polynomials or exact distances.

layout(binding = 6) uniform usamplerBuffer zones;  // blend extents and bounds of each leaf; see FieldUpload
layout(location = 18) uniform float blend;         // width of the blend zones as a share of a leaf's edge

const bool kBlended = true;

const int kWall = 31;     // in place of a neighbour's depth, for a leaf's face on the domain's boundary
const int kDeepest = 20;  // greatest depth of a leaf

// Returns true if the point `local` lies so near to a face of its leaf that several leaves are blended there.
bool isInBlendZone(vec3 local) { return any(greaterThan(abs(local), vec3(1.0 - 2.0 * blend))); }

// Finds the cells of depth `level` that are at most `near` (up to 0.5) times their edge length away from a point. The
// indices of these cells run from `first` to `first` + `more`, one or two cells along each axis. The point is given by
// the cell of depth `depth` that contains it and by its position `fraction` in that cell.
void candidateCells(ivec3 cellIndex, int depth, vec3 fraction, int level, float near, out ivec3 first,
                    out ivec3 more) {
  ivec3 cell;
  vec3 inCell;
  if (level <= depth) {
    int up = depth - level;
    cell = cellIndex >> up;
    inCell = (vec3(cellIndex - (cell << up)) + fraction) * ldexp(1.0, -up);
  } else {
    int down = level - depth;
    inCell = fraction * ldexp(1.0, down);
    ivec3 whole = ivec3(floor(inCell));
    cell = (cellIndex << down) + whole;
    inCell -= vec3(whole);
  }
  ivec3 last = (ivec3(grid) << level) - 1;
  first = clamp(cell - ivec3(lessThan(inCell, vec3(near))), ivec3(0), last);
  more = clamp(cell + ivec3(greaterThan(inCell, vec3(1.0 - near))), ivec3(0), last) - first;
}

// For each axis, takes the nearer of the leaf's two faces to the point `local`. Returns the depth of the smallest leaf
// at this face, or kWall if the face lies on the domain's boundary.
ivec3 smallestNeighbour(uint extents, vec3 local) {
  uvec3 shift = uvec3(0u, 10u, 20u) + 5u * uvec3(greaterThan(local, vec3(0.0)));
  return ivec3(uvec3(extents) >> shift & uint(kWall));
}

// Returns, for each axis, the distance of a point from the leaf's nearer face, positive inside the leaf. The
// distance is scaled such that the leaf's blending weight falls to zero at -1.
vec3 rampPosition(uint extents, int depth, vec3 local) {
  ivec3 neighbour = smallestNeighbour(extents, local);
  vec3 t = (1.0 - abs(local)) * ldexp(vec3(0.5), neighbour - depth) / blend;
  return mix(t, vec3(1.0), equal(neighbour, ivec3(kWall)));
}

// Returns the derivatives of the three factors of a leaf's blending weight, with respect to the leaf's local
// coordinates. `t` is the result of rampPosition.
vec3 rampSlopes(uint extents, int depth, vec3 local, vec3 t) {
  return -sign(local) * 0.75 * (1.0 - t * t) * ldexp(vec3(0.5), smallestNeighbour(extents, local) - depth) / blend;
}

// Converts a point's local coordinates to the local coordinates of another leaf, whose cell index is other.xyz and
// whose depth is other.w.
vec3 localInOther(ivec4 other, ivec3 cellIndex, int depth, vec3 local) {
  vec3 fraction = 0.5 * local + 0.5;
  int down = other.w - depth;
  vec3 inOther = down >= 0 ? fraction * ldexp(1.0, down) + vec3((cellIndex << down) - other.xyz)
                           : (vec3(cellIndex - (other.xyz << -down)) + fraction) * ldexp(1.0, down);
  return 2.0 * inOther - 1.0;
}

// candidateOffset returns the offset, 0 or 1 along each axis, of the n-th candidate cell from the first candidate cell.
// candidateNumber turns such an offset into a number from 0 to 7.
ivec3 candidateOffset(int n, ivec3 more) { return ivec3(n, n >> more.x, n >> (more.x + more.y)) & more; }
int candidateNumber(ivec3 offset) { return offset.x + 2 * offset.y + 4 * offset.z; }

// The weighted sum of the functions of leaves at a point. The first one is subtracted from all others to reduce
// rounding errors in single precision. Each vec4 holds a gradient (xyz), in the local coordinates of the leaf that
// contains the point, and a value (w).
struct LeafSum {
  vec4 first, sum, weights;
  float lowest, highest;  // value range of the leaves whose weights, widened by `margin`, reach the point
};

// Adds the function of `leaf` to the weighted sum. The leaf has the cell index other.xyz and the depth other.w.
void addLeaf(inout LeafSum total, Node leaf, ivec4 other, ivec3 cellIndex, int depth, vec3 local, float margin,
             bool withGradient) {
  bool own = other.w == depth && other.xyz == cellIndex;
  vec3 inOther = own ? local : localInOther(other, cellIndex, depth, local);
  uint extents = texelFetch(zones, int(leaf.index)).x;
  vec3 t = rampPosition(extents, other.w, inOther);
  if (any(lessThanEqual(t, vec3(-1.0 - margin)))) return;
  float scale = ldexp(1.0, other.w - depth);  // derivative of `inOther` with respect to `local`
  vec4 ofLeaf;
  if (withGradient) {
    ofLeaf = leafWithGradient(leaf, uint(other.w), uvec3(other.xyz), inOther);
    ofLeaf.xyz *= scale;
  } else {
    ofLeaf = vec4(vec3(0.0), leafValue(leaf, uint(other.w), uvec3(other.xyz), inOther));
  }
  total.lowest = min(total.lowest, ofLeaf.w);
  total.highest = max(total.highest, ofLeaf.w);
  t = clamp(t, vec3(-1.0), vec3(1.0));
  vec3 ramps = 0.5 + t * (0.75 - 0.25 * t * t);
  vec3 slopes = withGradient ? scale * rampSlopes(extents, other.w, inOther, t) : vec3(0.0);
  vec4 weight = vec4(slopes * ramps.yzx * ramps.zxy, ramps.x * ramps.y * ramps.z);
  if (!(weight.w > 0.0)) return;
  if (total.weights.w == 0.0) total.first = ofLeaf;
  vec4 difference = ofLeaf - total.first;
  total.weights += weight;
  total.sum += vec4(weight.xyz * difference.w + weight.w * difference.xyz, weight.w * difference.w);
}

// Finds the node for the candidate cell `cell` on the first level of the search. The node is the cell itself, or a
// larger leaf, `up` levels above, that contains the cell. Returns false if this larger leaf also contains an earlier
// candidate cell, because each leaf must count only once.
bool firstLevelNode(ivec3 cell, ivec3 offset, int level, out Node node, out int up) {
  up = level;
  node = fetchNode(baseCellIndex(uvec3(cell >> level)));
  while (!node.leaf && up > 0) {
    --up;
    node = fetchNode(childIndex(node, uvec3(cell >> up & 1)));
  }
  return !any(greaterThan(min(offset, cell - (cell >> up << up)), ivec3(0)));
}

// Finds the node for the candidate cell `cell` below the first level of the search. `parents` holds, for each internal
// candidate node one level above, the index of its first child. Returns false if the cell's parent is none of them.
bool nodeBelow(uint parents[8], ivec3 parentFirst, ivec3 parentMore, ivec3 cell, out Node node) {
  ivec3 parent = (cell >> 1) - parentFirst;
  if (any(lessThan(parent, ivec3(0))) || any(greaterThan(parent, parentMore))) return false;
  uint children = parents[candidateNumber(parent)];
  if (children == kNoCell) return false;
  node = fetchNode(children + uint(candidateNumber(cell & 1)));
  return true;
}

// Sums the functions of all leaves whose weights reach a point. Descends level by level through the nodes near the
// point. Nodes are found by integer cell indices, so that single precision is enough. Leaves are not collected in an
// array before they are evaluated, because drivers would unroll loops over the array and take seconds to compile.
LeafSum leafSumAt(Node leaf, ivec3 cellIndex, int depth, vec3 local, float margin, bool withGradient) {
  LeafSum total = LeafSum(vec4(0.0), vec4(0.0), vec4(0.0), 1e30, -1e30);
  vec3 fraction = 0.5 * local + 0.5;
  bool blended = isInBlendZone(local);
  uint open[8];  // index of the first child of each internal candidate node
  ivec3 first = cellIndex, more = ivec3(0);
  bool internal = true;
  for (int level = depth; internal && level <= kDeepest; ++level) {
    ivec3 parentFirst = first, parentMore = more;
    uint parents[8] = open;
    if (blended) candidateCells(cellIndex, depth, fraction, level, blend * (1.0 + margin), first, more);
    internal = false;
    for (int number = 0; number < 8; ++number) open[number] = kNoCell;
    int cells = 1 << (more.x + more.y + more.z);
    for (int n = 0; n < cells; ++n) {
      ivec3 offset = candidateOffset(n, more);
      ivec3 cell = first + offset;
      Node node;
      int up = 0;
      bool counts;
      if (level == depth) {
        counts = firstLevelNode(cell, offset, level, node, up);
      } else {
        counts = nodeBelow(parents, parentFirst, parentMore, cell, node);
      }
      if (!counts) continue;
      if (node.leaf) {
        addLeaf(total, node, ivec4(cell >> up, level - up), cellIndex, depth, local, margin, withGradient);
      } else {
        open[candidateNumber(offset)] = node.firstChild;
        internal = true;
      }
    }
  }
  return total;
}

// Returns the value of the blended field at a point, and the range of values that the functions of nearby leaves have at
// the point. A leaf is nearby if its weight would reach the point after its blend zone is widened by the share `margin`.
FieldRange blendedRange(Node leaf, uint depth, uvec3 cellIndex, vec3 local, float margin) {
  LeafSum total = leafSumAt(leaf, ivec3(cellIndex), int(depth), local, margin, false);
  return FieldRange(total.first.w + total.sum.w / total.weights.w, total.lowest, total.highest);
}

float fieldValue(Node leaf, uint depth, uvec3 cellIndex, vec3 local) {
  return blendedRange(leaf, depth, cellIndex, local, 0.0).value;
}

// Returns the gradient of the field with respect to the leaf's local coordinates (xyz) and its value (w).
vec4 fieldWithGradient(Node leaf, uint depth, uvec3 cellIndex, vec3 local) {
  LeafSum total = leafSumAt(leaf, ivec3(cellIndex), int(depth), local, 0.0, true);
  float mean = total.sum.w / total.weights.w;
  return total.first + vec4((total.sum.xyz - mean * total.weights.xyz) / total.weights.w, mean);
}

BlendZone blendZoneAt(uint leaf, vec3 fraction) {
  uvec4 zone = texelFetch(zones, int(leaf));
  return BlendZone(isInBlendZone(2.0 * fraction - 1.0), uintBitsToFloat(zone.y), uintBitsToFloat(zone.z),
                   uintBitsToFloat(zone.w), blend);
}
