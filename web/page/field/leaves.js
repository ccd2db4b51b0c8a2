// Walks through the leaves of the octree.

import { isLeaf } from "./field_file.js";

/** @typedef {import("./field_file.js").Field} Field */
/** @typedef {import("./field_file.js").Vector} Vector */

/**
 * Calls `visit` for each leaf with its depth and cell index.
 * @param {Field} field
 * @param {(node: number, depth: number, cell: Vector) => void} visit
 */
export function forEachLeaf(field, visit) {
  /**
   * @param {number} node
   * @param {number} depth
   * @param {Vector} cell
   */
  const walk = (node, depth, cell) => {
    if (isLeaf(field, node)) return visit(node, depth, cell);
    for (let child = 0; child < 8; ++child)
      walk(field.low[node] + child, depth + 1, [2 * cell[0] + (child & 1), 2 * cell[1] + ((child >> 1) & 1), 2 * cell[2] + (child >> 2)]);
  };
  let base = 0;
  for (let z = 0; z < field.grid[2]; ++z)
    for (let y = 0; y < field.grid[1]; ++y) for (let x = 0; x < field.grid[0]; ++x) walk(base++, 0, [x, y, z]);
}
