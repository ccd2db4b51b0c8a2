// Bounds of the field in every node of the octree, by which rays step (docs/rendering.md, "Tracing").

import { coefficientCount, coefficientIndex, degreeOf, isExact, isLeaf } from "../field/field_file.js";
import { blendDifference } from "../field/blend.js";
import { evaluateExact } from "../field/exact_leaf.js";
import { forEachLeaf } from "../field/leaves.js";
import { worldPoint } from "../field/query.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */

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
    bounds.low[node] -= blendDifference(field, node);
    bounds.high[node] += blendDifference(field, node);
  });
  for (let n = count; n-- > 0; ) {
    // children follow their parents
    if (isLeaf(field, n)) continue;
    const first = field.low[n];
    bounds.low[n] = Infinity;
    bounds.high[n] = -Infinity;
    for (let child = first; child < first + 8; ++child) {
      bounds.low[n] = Math.min(bounds.low[n], bounds.low[child]);
      bounds.high[n] = Math.max(bounds.high[n], bounds.high[child]);
    }
  }
  return bounds;
}

/**
 * The greatest derivatives of the products L_i(u) L_j(v) L_k(w) over the cell, for the coefficients of one degree in their order:
 * nine numbers each, three of first derivatives, three of second derivatives along an axis, three of mixed ones.
 * @type {Map<number, Float64Array>}
 */
const derivativesOfDegree = new Map();

/**
 * @param {number} degree
 */
function derivativesOf(degree) {
  const known = derivativesOfDegree.get(degree);
  if (known) return known;
  const numbers = [];
  for (let i = 0; i <= degree; ++i)
    for (let j = 0; j <= degree - i; ++j)
      for (let k = 0; k <= degree - i - j; ++k) {
        const [x, y, z] = [i, j, k].map((n) => (n * (n + 1)) / 2);
        numbers.push(x, y, z, ...[i, j, k].map((n) => ((n - 1) * n * (n + 1) * (n + 2)) / 8), y * z, z * x, x * y);
      }
  const made = new Float64Array(numbers);
  derivativesOfDegree.set(degree, made);
  return made;
}

/** Sums of derivatives, which are used again for each leaf. */
const sums = new Float64Array(9);

/**
 * @param {Field} field
 * @param {number} node
 * @param {Bounds} bounds
 */
function setPolynomialBounds(field, node, bounds) {
  const degree = degreeOf(field, node);
  const c = field.coefficients;
  const first = field.first[node];
  const count = coefficientCount(degree);
  const derivatives = derivativesOf(degree);
  sums.fill(0);
  let sum = 0;
  for (let n = 0; n < count; ++n) {
    const magnitude = Math.abs(c[first + n]);
    sum += magnitude;
    if (magnitude > 0) for (let m = 0; m < 9; ++m) sums[m] += magnitude * derivatives[9 * n + m];
  }
  // The constant and the linear coefficients, which the linear part takes away. Their order is that of i, j, k.
  const linear = degree > 0 ? [coefficientIndex(degree, 1, 0, 0), coefficientIndex(degree, 0, 1, 0), coefficientIndex(degree, 0, 0, 1)] : [];
  const mean = c[first];
  let nonlinear = sum - Math.abs(mean);
  linear.forEach((index, axis) => {
    const slope = c[first + index];
    bounds.linear[4 * node + axis] = slope;
    nonlinear -= Math.abs(slope);
    sums[axis] -= Math.abs(slope);
  });
  const rounding = ROUNDING * sum;
  const range = sum - Math.abs(mean) + rounding;
  bounds.linear[4 * node + 3] = mean;
  bounds.low[node] = mean - range;
  bounds.high[node] = mean + range;
  bounds.value[node] = Math.max(nonlinear, 0) + rounding;
  bounds.gradient[node] = lengthOf(sums, 0) * (1 + ROUNDING) + rounding;
  bounds.second[node] = Math.sqrt(lengthOf(sums, 3) ** 2 + 2 * lengthOf(sums, 6) ** 2) * (1 + ROUNDING) + rounding;
}

/**
 * Returns the length of the vector of three numbers from an index on.
 * @param {Float64Array} numbers
 * @param {number} at
 */
function lengthOf(numbers, at) {
  return Math.sqrt(numbers[at] ** 2 + numbers[at + 1] ** 2 + numbers[at + 2] ** 2);
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
  const central = evaluateExact(field, node, [0, 0, 0], centre).value;
  const range = Math.hypot(...half) * (1 + ROUNDING) + ROUNDING * (Math.abs(central) + Math.hypot(...field.size));
  bounds.linear[4 * node + 3] = central;
  bounds.low[node] = central - range;
  bounds.high[node] = central + range;
  bounds.value[node] = range;
  bounds.gradient[node] = Math.max(...half) * (1 + ROUNDING);
  bounds.second[node] = EXACT_CURVE;
}
