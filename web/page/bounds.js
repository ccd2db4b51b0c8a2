// Bounds of the field in every node of the octree, by which rays step (docs/rendering.md, "Tracing").

import { degreeOf, isExact, isLeaf } from "./field_file.js";
import { evaluateExact } from "./exact_leaf.js";
import { forEachLeaf } from "./leaves.js";
import { worldPoint } from "./query.js";

/** @typedef {import("./field_file.js").Field} Field */
/** @typedef {import("./field_file.js").Vector} Vector */

/** Relative rounding of single precision with which the bounds are widened. */
const ROUNDING = 4e-6;

/** A bound of the second derivative that no step takes into account: distances of triangles bend. */
const EXACT_CURVE = 1e30;

/**
 * For each node one number in each array.
 * @typedef {object} Bounds
 * @property {Float32Array} low  least value of the field in the node
 * @property {Float32Array} high
 * @property {Float32Array} value  of a leaf: greatest difference of the field from its linear part
 * @property {Float32Array} gradient  of a leaf: greatest difference of the gradients, in local coordinates; −1 for internal nodes
 * @property {Float32Array} second  of a leaf: greatest second derivative in any direction, in local coordinates
 * @property {Float32Array} linear  of a leaf: slopes along the local coordinates, and the value at the centre
 */

/**
 * @param {Field} field
 * @returns {Bounds}
 */
export function boundsOf(field) {
  const count = field.low.length;
  const make = () => new Float32Array(count);
  const bounds = { low: make(), high: make(), value: make(), gradient: make().fill(-1), second: make(), linear: new Float32Array(4 * count) };
  forEachLeaf(field, (node, depth, cell) => {
    if (isExact(field, node)) setExactBounds(field, node, depth, cell, bounds);
    else setPolynomialBounds(field, node, bounds);
  });
  for (let n = count; n-- > 0; ) {
    // children follow their parents
    if (isLeaf(field, n)) continue;
    const first = field.low[n];
    bounds.low[n] = Math.min(...bounds.low.subarray(first, first + 8));
    bounds.high[n] = Math.max(...bounds.high.subarray(first, first + 8));
  }
  return bounds;
}

/**
 * @param {Field} field
 * @param {number} node
 * @param {Bounds} bounds
 */
function setPolynomialBounds(field, node, bounds) {
  const degree = degreeOf(field, node);
  const c = field.coefficients;
  const first = field.first[node];
  let index = first;
  let sum = 0, nonlinear = 0;
  const slope = [0, 0, 0], pure = [0, 0, 0], mixed = [0, 0, 0];
  for (let i = 0; i <= degree; ++i)
    for (let j = 0; j <= degree - i; ++j)
      for (let k = 0; k <= degree - i - j; ++k) {
        const magnitude = Math.abs(c[index++]);
        sum += magnitude;
        if (i + j + k < 2) {
          if (i + j + k === 1) bounds.linear[4 * node + (i ? 0 : j ? 1 : 2)] = c[index - 1];
          continue;
        }
        nonlinear += magnitude;
        const one = [i, j, k].map((n) => (n * (n + 1)) / 2);
        const two = [i, j, k].map((n) => ((n - 1) * n * (n + 1) * (n + 2)) / 8);
        for (let a = 0; a < 3; ++a) {
          slope[a] += magnitude * one[a];
          pure[a] += magnitude * two[a];
          mixed[a] += magnitude * one[(a + 1) % 3] * one[(a + 2) % 3];
        }
      }
  const rounding = ROUNDING * sum;
  const mean = c[first];
  const range = sum - Math.abs(mean) + rounding;
  bounds.linear[4 * node + 3] = mean;
  bounds.low[node] = mean - range;
  bounds.high[node] = mean + range;
  bounds.value[node] = nonlinear + rounding;
  bounds.gradient[node] = Math.hypot(...slope) * (1 + ROUNDING) + rounding;
  bounds.second[node] = Math.sqrt(pure.reduce((s, x) => s + x * x, 0) + 2 * mixed.reduce((s, x) => s + x * x, 0)) * (1 + ROUNDING) + rounding;
}

/**
 * @param {Field} field
 * @param {number} node
 * @param {number} depth
 * @param {Vector} cell
 * @param {Bounds} bounds
 */
function setExactBounds(field, node, depth, cell, bounds) {
  const edge = 2 ** -depth;
  const half = field.size.map((x, a) => (0.5 * x * edge) / field.grid[a]);
  const centre = worldPoint(field, /** @type {Vector} */ (cell.map((x) => (x + 0.5) * edge)));
  const central = evaluateExact(field, node, centre).value;
  const range = Math.hypot(...half) * (1 + ROUNDING) + ROUNDING * (Math.abs(central) + Math.hypot(...field.size));
  bounds.linear[4 * node + 3] = central;
  bounds.low[node] = central - range;
  bounds.high[node] = central + range;
  bounds.value[node] = range;
  bounds.gradient[node] = Math.max(...half) * (1 + ROUNDING);
  bounds.second[node] = EXACT_CURVE;
}
