// The edges of the cells that stand in the picture of a surface.

import { forEachLeaf } from "../field/leaves.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */

/**
 * Returns the edges of leaves, in the field's units: for each of its two ends x, y, z and the length of the edge. An edge that cells of one
 * depth share is there once.
 * @param {Field} field
 * @param {string} depths  all, or depths with commas between them
 */
export function cellLines(field, depths) {
  /** @type {number[]} */
  const numbers = [];
  /** @type {Map<number, Set<number>>} */
  const known = new Map();
  const chosen = depths === "all" ? null : new Set(depths.split(",").map(Number));
  forEachLeaf(field, (_, depth, cell) => {
    if (chosen && !chosen.has(depth)) return;
    const [nx, ny] = field.grid.map((x) => x * 2 ** depth + 1);
    for (let edge = 0; edge < 12; ++edge) {
      // Edges 0 to 3 run along x, 4 to 7 along y, 8 to 11 along z. The two low bits choose the sides along the other axes.
      const axis = edge >> 2;
      const from = /** @type {Vector} */ ([...cell]);
      from[(axis + 1) % 3] += edge & 1;
      from[(axis + 2) % 3] += (edge >> 1) & 1;
      const kind = 3 * depth + axis;
      const seen = known.get(kind) ?? new Set();
      known.set(kind, seen);
      const key = from[0] + nx * (from[1] + ny * from[2]);
      if (seen.has(key)) continue;
      seen.add(key);
      addEdge(field, from, axis, depth, numbers);
    }
  });
  return new Float32Array(numbers);
}

/**
 * @param {Field} field
 * @param {Vector} from  in cells of the depth
 * @param {number} axis
 * @param {number} depth
 * @param {number[]} numbers
 */
function addEdge(field, from, axis, depth, numbers) {
  const cellSize = field.size.map((x, a) => x / field.grid[a] / 2 ** depth);
  for (const step of [0, 1]) {
    for (let a = 0; a < 3; ++a) numbers.push(field.lower[a] + (from[a] + (a === axis ? step : 0)) * cellSize[a]);
    numbers.push(cellSize[axis]);
  }
}
