// Blended fields: near the faces of a leaf, the field is the weighted mean of the functions of several leaves
// (core/src/field/query/blend.h).

import { isLeaf } from "./field_file.js";
import { forEachLeaf, nodeAt } from "./leaves.js";
import { add, scaled, subtract } from "./vector.js";

/** @typedef {import("./field_file.js").Field} Field */
/** @typedef {import("./field_file.js").Vector} Vector */
/** @typedef {import("./leaves.js").OctreeNode} OctreeNode */
/** @typedef {import("./query.js").LeafPoint} LeafPoint */
/** @typedef {import("./query.js").ValueAndGradient} ValueAndGradient */

/** Stands in place of a depth for a face on the domain's boundary. It is greater than all depths. */
const DOMAIN_FACE = 31;
const FACE_BITS = 5;

/**
 * Calls `visit` with the larger leaf in each direction in which a leaf touches a larger one.
 * @param {Field} field
 * @param {OctreeNode} leaf
 * @param {(larger: OctreeNode) => void} visit
 */
function forEachLargerNeighbour(field, { depth, cell }, visit) {
  const [x, y, z] = cell;
  const [lastX, lastY, lastZ] = field.grid.map((n) => n * 2 ** depth - 1);
  const half = (/** @type {number} */ index) => Math.floor(index / 2);
  for (let k = Math.max(z - 1, 0); k <= Math.min(z + 1, lastZ); ++k)
    for (let j = Math.max(y - 1, 0); j <= Math.min(y + 1, lastY); ++j)
      for (let i = Math.max(x - 1, 0); i <= Math.min(x + 1, lastX); ++i) {
        if (half(i) === half(x) && half(j) === half(y) && half(k) === half(z)) continue; // another child of the same node is not larger
        const found = nodeAt(field, [i, j, k], depth);
        if (found.depth < depth && isLeaf(field, found.node)) visit(found);
      }
}

/**
 * Returns for each leaf and each of its six faces the depth of the smallest leaf that touches the face, or DOMAIN_FACE. A node has
 * 30 bits: five for each face, along x, y and z the lower one and then the upper one.
 * @param {Field} field
 */
function findBlendExtents(field) {
  const depths = new Uint8Array(6 * field.low.length);
  const raise = (/** @type {number} */ node, /** @type {number} */ face, /** @type {number} */ depth) => {
    if (depths[6 * node + face] < depth) depths[6 * node + face] = depth;
  };
  forEachLeaf(field, (node, depth, cell) => {
    for (let axis = 0; axis < 3; ++axis) {
      raise(node, 2 * axis, cell[axis] === 0 ? DOMAIN_FACE : depth);
      raise(node, 2 * axis + 1, cell[axis] + 1 === field.grid[axis] * 2 ** depth ? DOMAIN_FACE : depth);
    }
    forEachLargerNeighbour(field, { node, depth, cell }, (larger) => {
      const levels = depth - larger.depth;
      for (let axis = 0; axis < 3; ++axis) {
        const offset = cell[axis] - larger.cell[axis] * 2 ** levels;
        if (offset <= 0) raise(larger.node, 2 * axis, depth);
        if (offset >= 2 ** levels - 1) raise(larger.node, 2 * axis + 1, depth);
      }
    });
  });
  return Uint32Array.from(field.low, (_, node) => {
    let extents = 0;
    for (let face = 0; face < 6; ++face) extents |= depths[6 * node + face] << (FACE_BITS * face);
    return extents;
  });
}

/** @type {WeakMap<Field, Uint32Array>} */
const knownExtents = new WeakMap();

/**
 * Returns the blend extents of all nodes, which are found once for each field.
 * @param {Field} field
 */
export function blendExtents(field) {
  const extents = knownExtents.get(field) ?? findBlendExtents(field);
  knownExtents.set(field, extents);
  return extents;
}

/**
 * Returns a bound of the difference between the field and the function of a leaf, within the leaf.
 * @param {Field} field
 * @param {number} leaf
 */
export function blendDifference(field, leaf) {
  return field.zones ? field.zones[3 * leaf] : 0;
}

/**
 * Returns true if a point lies so near to a face of its leaf that other leaves may have a weight there.
 * @param {Field} field
 * @param {LeafPoint} leaf
 */
export function isInBlendZone(field, leaf) {
  return field.blend > 0 && leaf.local.some((x) => Math.abs(x) > 1 - 2 * field.blend);
}

/**
 * Returns one of the three factors of a leaf's weight, with its derivative along the axis in the field's units.
 * @param {Field} field
 * @param {LeafPoint} leaf
 * @param {number} axis
 */
function rampAlong(field, leaf, axis) {
  const isUpper = leaf.local[axis] > 0;
  const depth = (blendExtents(field)[leaf.node] >> (FACE_BITS * (2 * axis + (isUpper ? 1 : 0)))) & DOMAIN_FACE;
  if (depth === DOMAIN_FACE) return { value: 1, slope: 0 };
  const scale = 2 ** (depth - leaf.depth - 1) / field.blend; // local coordinates to half widths of the blend zone
  const t = Math.min(Math.max((1 - Math.abs(leaf.local[axis])) * scale, -1), 1);
  const toWorld = (2 * 2 ** leaf.depth * field.grid[axis]) / field.size[axis];
  return { value: 0.5 + t * (0.75 - 0.25 * t * t), slope: (isUpper ? -0.75 : 0.75) * (1 - t * t) * scale * toWorld };
}

/**
 * Calls `visit` for each leaf whose distance from a point is, along each axis, at most the share `blend` of the leaf's edge. The
 * local coordinates of the point lie outside of [−1, 1] in all leaves but its own.
 * @param {Field} field
 * @param {Vector} point  grid coordinates
 * @param {(leaf: LeafPoint) => void} visit
 */
function forEachLeafNear(field, point, visit) {
  const { blend, grid, low } = field;
  /**
   * @param {number} node
   * @param {number} depth
   * @param {Vector} cell
   */
  const walk = (node, depth, cell) => {
    const inCell = point.map((x, a) => x * 2 ** depth - cell[a]);
    if (inCell.some((x) => x < -blend || x > 1 + blend)) return;
    if (isLeaf(field, node)) return visit({ node, depth, cell, local: /** @type {Vector} */ (inCell.map((x) => 2 * x - 1)) });
    for (let child = 0; child < 8; ++child)
      walk(low[node] + child, depth + 1, [2 * cell[0] + (child & 1), 2 * cell[1] + ((child >> 1) & 1), 2 * cell[2] + (child >> 2)]);
  };
  const first = point.map((x) => Math.max(Math.floor(x - blend), 0));
  const last = point.map((x, a) => Math.min(Math.floor(x + blend), grid[a] - 1));
  for (let z = first[2]; z <= last[2]; ++z)
    for (let y = first[1]; y <= last[1]; ++y)
      for (let x = first[0]; x <= last[0]; ++x) walk((z * grid[1] + y) * grid[0] + x, 0, [x, y, z]);
}

/**
 * Returns the mean of the functions of all leaves that have a weight at a point, with its gradient. The function of the first leaf
 * is subtracted from the others, so that equal values give exactly that value.
 * @param {Field} field
 * @param {Vector} point  grid coordinates
 * @param {(leaf: LeafPoint) => ValueAndGradient} evaluate
 * @returns {ValueAndGradient}
 */
export function evaluateBlended(field, point, evaluate) {
  /** @type {ValueAndGradient | null} */
  let first = null;
  let weights = 0, sum = 0;
  /** @type {Vector} */
  let slopes = [0, 0, 0];
  /** @type {Vector} */
  let gradients = [0, 0, 0];
  forEachLeafNear(field, point, (leaf) => {
    const [x, y, z] = [0, 1, 2].map((axis) => rampAlong(field, leaf, axis));
    const weight = x.value * y.value * z.value;
    if (!(weight > 0)) return;
    const found = evaluate(leaf);
    first ??= found;
    const difference = found.value - first.value;
    /** @type {Vector} */
    const slope = [x.slope * y.value * z.value, x.value * y.slope * z.value, x.value * y.value * z.slope];
    weights += weight;
    sum += weight * difference;
    slopes = add(slopes, slope);
    gradients = add(gradients, add(scaled(slope, difference), scaled(subtract(found.gradient, first.gradient), weight)));
  });
  const { value, gradient } = /** @type {ValueAndGradient} */ (/** @type {unknown} */ (first)); // the leaf that holds the point has a weight
  const mean = sum / weights;
  return { value: value + mean, gradient: add(gradient, scaled(subtract(gradients, scaled(slopes, mean)), 1 / weights)) };
}
