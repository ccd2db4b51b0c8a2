// Walks through the leaves of the octree.

import { isLeaf } from "./field_file.js";

/** @typedef {import("./field_file.js").Field} Field */
/** @typedef {import("./field_file.js").Vector} Vector */

/**
 * A node of the octree and its cell, whose index counts cells of its depth from the domain's lower corner.
 * @typedef {{node: number, depth: number, cell: Vector}} OctreeNode
 */

/**
 * Returns the node of the cell with this index and depth or, if the octree has no such node, the larger leaf that holds the cell.
 * @param {Field} field
 * @param {Vector} cell
 * @param {number} depth
 * @returns {OctreeNode}
 */
export function nodeAt(field, cell, depth) {
  const { grid, low } = field;
  const [x, y, z] = cell;
  const base = cell.map((index) => Math.floor(index / 2 ** depth)); // indices may have more than 32 bits
  let node = (base[2] * grid[1] + base[1]) * grid[0] + base[0];
  let levels = depth; // from the node down to the cell
  while (levels > 0 && !isLeaf(field, node)) {
    --levels;
    node = low[node] + ((x >> levels) & 1) + 2 * ((y >> levels) & 1) + 4 * ((z >> levels) & 1);
  }
  return { node, depth: depth - levels, cell: /** @type {Vector} */ (cell.map((index) => Math.floor(index / 2 ** levels))) };
}

/**
 * Returns the children of an internal node, from the first to the last.
 * @param {Field} field
 * @param {OctreeNode} parent
 * @returns {OctreeNode[]}
 */
export function childrenOf(field, { node, depth, cell: [x, y, z] }) {
  return [0, 1, 2, 3, 4, 5, 6, 7].map((n) => ({
    node: field.low[node] + n,
    depth: depth + 1,
    cell: [2 * x + (n & 1), 2 * y + ((n >> 1) & 1), 2 * z + (n >> 2)],
  }));
}

/**
 * Gives the leaves one after the other, in the order of `forEachLeaf`.
 * @param {Field} field
 * @returns {Generator<OctreeNode, void>}
 */
export function* leavesInOrder(field) {
  const [sizeX, sizeY, sizeZ] = field.grid;
  for (let base = 0; base < sizeX * sizeY * sizeZ; ++base) {
    const row = Math.floor(base / sizeX);
    /** @type {OctreeNode[]} */
    const stack = [{ node: base, depth: 0, cell: [base % sizeX, row % sizeY, Math.floor(row / sizeY)] }];
    for (let next = stack.pop(); next; next = stack.pop()) {
      if (isLeaf(field, next.node)) yield next;
      else stack.push(...childrenOf(field, next).reverse());
    }
  }
}

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
