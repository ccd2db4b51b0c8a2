// The edges of the cells that stand in the picture of a surface.

import { leavesInOrder } from "../field/leaves.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */

/**
 * Collects the edges of leaves. An edge that cells of one depth share is there once.
 */
export class CellLines {
  /**
   * @param {Field} field
   * @param {string} depths  all, or depths with commas between them
   */
  constructor(field, depths) {
    this.field = field;
    this.chosen = depths === "all" ? null : new Set(depths.split(",").map(Number));
    this.leaves = leavesInOrder(field);
    /** @type {Map<number, Set<number>>} */
    this.known = new Map();
    this.numbers = new Float32Array(1 << 16); // for each of an edge's two ends x, y, z and the length of the edge, in the field's units
    this.count = 0;
  }

  /** The number of ends. */
  get ends() {
    return this.count / 4;
  }

  /**
   * Goes on for some milliseconds, and returns true when all leaves have been seen.
   * @param {number} milliseconds
   */
  run(milliseconds) {
    const end = performance.now() + milliseconds;
    while (performance.now() < end)
      for (let n = 0; n < 64; ++n) {
        const { value: leaf, done } = this.leaves.next();
        if (done || !leaf) return true;
        if (!this.chosen || this.chosen.has(leaf.depth)) this.addLeaf(leaf.depth, leaf.cell);
      }
    return false;
  }

  /**
   * @param {number} depth
   * @param {Vector} cell
   */
  addLeaf(depth, cell) {
    const { grid } = this.field;
    const nx = grid[0] * 2 ** depth + 1, ny = grid[1] * 2 ** depth + 1;
    for (let edge = 0; edge < 12; ++edge) {
      // Edges 0 to 3 run along x, 4 to 7 along y, 8 to 11 along z. The two low bits choose the sides along the other axes.
      const axis = edge >> 2;
      /** @type {Vector} */
      const from = [cell[0], cell[1], cell[2]];
      from[(axis + 1) % 3] += edge & 1;
      from[(axis + 2) % 3] += (edge >> 1) & 1;
      const kind = 3 * depth + axis;
      const seen = this.known.get(kind) ?? new Set();
      this.known.set(kind, seen);
      const key = from[0] + nx * (from[1] + ny * from[2]);
      if (seen.has(key)) continue;
      seen.add(key);
      this.addEdge(from, axis, depth);
    }
  }

  /**
   * @param {Vector} from  in cells of the depth
   * @param {number} axis
   * @param {number} depth
   */
  addEdge(from, axis, depth) {
    const { size, grid, lower } = this.field;
    if (this.count + 8 > this.numbers.length) {
      const larger = new Float32Array(2 * this.numbers.length);
      larger.set(this.numbers);
      this.numbers = larger;
    }
    for (let step = 0; step < 2; ++step) {
      for (let a = 0; a < 3; ++a) this.numbers[this.count++] = lower[a] + ((from[a] + (a === axis ? step : 0)) * size[a]) / grid[a] / 2 ** depth;
      this.numbers[this.count++] = size[axis] / grid[axis] / 2 ** depth;
    }
  }
}
