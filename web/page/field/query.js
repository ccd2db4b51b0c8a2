// Values and gradients of a field at points, in double precision.

import { degreeOf, isExact, isLeaf } from "./field_file.js";
import { evaluateBlended, isInBlendZone } from "./blend.js";
import { evaluateExact } from "./exact_leaf.js";

/** @typedef {import("./field_file.js").Field} Field */
/** @typedef {import("./field_file.js").Vector} Vector */

/**
 * A point in a leaf of the octree.
 * @typedef {object} LeafPoint
 * @property {number} node
 * @property {number} depth
 * @property {Vector} cell  integer coordinates of the cell, in units of its edges from the domain's lower corner
 * @property {Vector} local  the point, in [−1, 1]³ if the leaf contains it
 */

/** @typedef {{value: number, gradient: Vector}} ValueAndGradient */

/**
 * Returns the grid coordinates of a point: the domain is [0, grid]. It rounds as the program does.
 * @param {Field} field
 * @param {Vector} point
 * @returns {Vector}
 */
export function gridPoint(field, point) {
  return /** @type {Vector} */ (point.map((x, a) => ((x - field.lower[a]) / field.size[a]) * field.grid[a]));
}

/**
 * Returns a vector in grid coordinates.
 * @param {Field} field
 * @param {Vector} direction
 * @returns {Vector}
 */
export function gridDirection(field, direction) {
  return /** @type {Vector} */ (direction.map((x, a) => (x / field.size[a]) * field.grid[a]));
}

/**
 * Returns the world coordinates of a point of the grid.
 * @param {Field} field
 * @param {Vector} point
 * @returns {Vector}
 */
export function worldPoint(field, point) {
  return /** @type {Vector} */ (point.map((x, a) => field.lower[a] + (x / field.grid[a]) * field.size[a]));
}

/**
 * Returns the leaf that contains a point, or null outside of the domain. Cells are half-open; the domain's upper faces belong to
 * the last cells.
 * @param {Field} field
 * @param {Vector} grid  grid coordinates
 * @returns {LeafPoint | null}
 */
export function leafAt(field, grid) {
  if (grid.some((x, a) => !(x >= 0 && x <= field.grid[a]))) return null;
  const cell = grid.map((x, a) => Math.min(Math.floor(x), field.grid[a] - 1));
  const fraction = grid.map((x, a) => x - cell[a]);
  let node = (cell[2] * field.grid[1] + cell[1]) * field.grid[0] + cell[0];
  let depth = 0;
  for (; !isLeaf(field, node); ++depth) {
    let child = 0;
    for (let a = 0; a < 3; ++a) {
      const doubled = 2 * fraction[a];
      const upper = doubled >= 1 ? 1 : 0;
      fraction[a] = doubled - upper;
      cell[a] = 2 * cell[a] + upper;
      child |= upper << a;
    }
    node = field.low[node] + child;
  }
  return { node, depth, cell: /** @type {Vector} */ (cell), local: /** @type {Vector} */ (fraction.map((x) => 2 * x - 1)) };
}

/**
 * Returns the field's value and gradient at a point, with the leaf that contains it, or null outside of the domain.
 * @param {Field} field
 * @param {Vector} point  in the field's units
 * @returns {(ValueAndGradient & {leaf: LeafPoint}) | null}
 */
export function query(field, point) {
  return queryGrid(field, gridPoint(field, point));
}

/**
 * As `query`, at a point in grid coordinates.
 * @param {Field} field
 * @param {Vector} grid
 * @returns {(ValueAndGradient & {leaf: LeafPoint}) | null}
 */
export function queryGrid(field, grid) {
  const leaf = leafAt(field, grid);
  return leaf && { ...evaluateInLeaf(field, grid, leaf), leaf };
}

/**
 * Evaluates the field at a point of a leaf. On a face of the leaf, the result is the limit from within the leaf.
 * @param {Field} field
 * @param {Vector} grid  grid coordinates of the point
 * @param {LeafPoint} leaf
 * @returns {ValueAndGradient}
 */
function evaluateInLeaf(field, grid, leaf) {
  if (isInBlendZone(field, leaf)) return evaluateBlended(field, grid, (near) => evaluateLeaf(field, grid, near));
  return evaluateLeaf(field, grid, leaf);
}

/**
 * Evaluates the function of one leaf at a point, which may lie beyond the leaf's faces.
 * @param {Field} field
 * @param {Vector} grid  grid coordinates of the point
 * @param {LeafPoint} leaf  the leaf, with the point's local coordinates in it
 * @returns {ValueAndGradient}
 */
function evaluateLeaf(field, grid, leaf) {
  if (isExact(field, leaf.node)) return evaluateExact(field, leaf.node, leaf.local, worldPoint(field, grid));
  const { value, gradient } = evaluatePolynomial(field.coefficients, field.first[leaf.node], degreeOf(field, leaf.node), leaf.local);
  const scale = 2 * 2 ** leaf.depth;
  return { value, gradient: /** @type {Vector} */ (gradient.map((g, a) => (g * scale * field.grid[a]) / field.size[a])) };
}

/**
 * Evaluates the field at a point of a leaf, with the limit from within the leaf on its faces.
 * @param {Field} field
 * @param {import("./leaves.js").OctreeNode} leaf
 * @param {Vector} grid  grid coordinates of the point
 */
export function evaluateIn(field, leaf, grid) {
  const local = /** @type {Vector} */ (grid.map((x, a) => 2 * (x * 2 ** leaf.depth - leaf.cell[a]) - 1));
  return evaluateInLeaf(field, grid, { ...leaf, local });
}

const kRow = 32;
const legendre = new Float64Array(3 * kRow);
const slopes = new Float64Array(3 * kRow);

/**
 * Writes the Legendre polynomials up to a degree at one coordinate, and their derivatives, to rows of tables.
 * @param {number} x
 * @param {number} degree
 * @param {Float64Array} values
 * @param {Float64Array} derivatives
 * @param {number} row  index at which the row begins
 */
export function tabulateLegendre(x, degree, values, derivatives, row) {
  values[row] = 1;
  derivatives[row] = 0;
  for (let n = 0; n < degree; ++n) {
    const before = n > 0 ? values[row + n - 1] : 0;
    values[row + n + 1] = ((2 * n + 1) * x * values[row + n] - n * before) / (n + 1);
    derivatives[row + n + 1] = (n > 0 ? derivatives[row + n - 1] : 0) + (2 * n + 1) * values[row + n];
  }
}

/**
 * Evaluates Σ c_ijk L_i(u) L_j(v) L_k(w) and its gradient with respect to (u, v, w).
 * @param {Float32Array | Float64Array} c
 * @param {number} at  the index of the first coefficient
 * @param {number} degree
 * @param {Vector} local
 * @returns {ValueAndGradient}
 */
export function evaluatePolynomial(c, at, degree, local) {
  for (let a = 0; a < 3; ++a) tabulateLegendre(local[a], degree, legendre, slopes, a * kRow);
  let value = 0, gx = 0, gy = 0, gz = 0;
  let index = at;
  for (let i = 0; i <= degree; ++i) {
    let plane = 0, planeY = 0, planeZ = 0;
    for (let j = 0; j <= degree - i; ++j) {
      let line = 0, lineZ = 0;
      for (let k = 0; k <= degree - i - j; ++k) {
        const x = c[index++];
        line += x * legendre[2 * kRow + k];
        lineZ += x * slopes[2 * kRow + k];
      }
      plane += line * legendre[kRow + j];
      planeY += line * slopes[kRow + j];
      planeZ += lineZ * legendre[kRow + j];
    }
    value += plane * legendre[i];
    gx += plane * slopes[i];
    gy += planeY * legendre[i];
    gz += planeZ * legendre[i];
  }
  return { value, gradient: [gx, gy, gz] };
}

