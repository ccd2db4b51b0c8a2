// Blocks of pixels whose rays may hit the surface, with a lower bound of the distance to it: only these are drawn. The program
// finds them in the same way (render/src/view/surface_blocks.h).

import { isLeaf } from "./field_file.js";
import { gridPoint } from "./query.js";

/** @typedef {import("./field_file.js").Field} Field */
/** @typedef {import("./field_file.js").Vector} Vector */
/** @typedef {import("./bounds.js").Bounds} Bounds */
/** @typedef {import("./camera.js").Rays} Rays */

const BLOCK = 8; // pixels along each side of a block

/**
 * Returns the inverse of a matrix with these columns, by rows.
 * @param {Vector} a
 * @param {Vector} b
 * @param {Vector} c
 */
function inverseRows(a, b, c) {
  const bc = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
  const ca = [c[1] * a[2] - c[2] * a[1], c[2] * a[0] - c[0] * a[2], c[0] * a[1] - c[1] * a[0]];
  const ab = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const determinant = a[0] * bc[0] + a[1] * bc[1] + a[2] * bc[2];
  return [bc, ca, ab].map((row) => row.map((x) => x / determinant));
}

/**
 * @param {Field} field
 * @param {Bounds} bounds
 * @param {Rays} rays
 * @param {number} width
 * @param {number} height
 * @param {number} offset
 * @returns {{side: number, blocks: Float32Array}}  the sign of the field minus the offset where rays start, and for each block the
 *   upper left pixel and the distance up to which its rays keep that sign
 */
export function surfaceBlocks(field, bounds, rays, width, height, offset) {
  const columns = Math.ceil(width / BLOCK);
  const rows = Math.ceil(height / BLOCK);
  const starts = new Float32Array(columns * rows).fill(Infinity);
  const eye = gridPoint(field, rays.eye);
  const toWorld = field.size.map((x, a) => x / field.grid[a]);
  const view = inverseRows(rays.forward, rays.right, rays.up).map((row) => row.map((x, a) => x * toWorld[a]));
  const diagonal = Math.hypot(...field.size);
  const near = 1e-9 * diagonal;

  const clampedEye = eye.map((x, a) => Math.min(Math.max(x, 0), field.grid[a]));
  const home = clampedEye.map((x, a) => Math.min(Math.floor(x), field.grid[a] - 1));
  const homeNode = (home[2] * field.grid[1] + home[1]) * field.grid[0] + home[0];
  const side = 0.5 * (bounds.low[homeNode] + bounds.high[homeNode]) >= offset ? 1 : -1;

  /** The blocks that rays through a box may have: x0, y0, x1, y1, half-open. */
  const rect = [0, 0, 0, 0];
  /**
   * @param {number} x
   * @param {number} y
   * @param {number} z
   * @param {number} size
   */
  const project = (x, y, z, size) => {
    const corner = view.map((row) => row[0] * (x - eye[0]) + row[1] * (y - eye[1]) + row[2] * (z - eye[2]));
    let x0 = Infinity, y0 = Infinity, x1 = -Infinity, y1 = -Infinity;
    let behind = 0;
    const outside = [0, 0, 0, 0];
    for (let i = 0; i < 8; ++i) {
      const dx = i & 1 ? size : 0, dy = i & 2 ? size : 0, dz = i & 4 ? size : 0;
      const depth = corner[0] + view[0][0] * dx + view[0][1] * dy + view[0][2] * dz;
      const u = corner[1] + view[1][0] * dx + view[1][1] * dy + view[1][2] * dz;
      const v = corner[2] + view[2][0] * dx + view[2][1] * dy + view[2][2] * dz;
      const edge = rays.parallel ? 1 : depth;
      if (u > edge) ++outside[0];
      if (-u > edge) ++outside[1];
      if (v > edge) ++outside[2];
      if (-v > edge) ++outside[3];
      if (!(depth > near)) {
        ++behind;
        if (!rays.parallel) continue;
      }
      x0 = Math.min(x0, u / edge);
      x1 = Math.max(x1, u / edge);
      y0 = Math.min(y0, -v / edge);
      y1 = Math.max(y1, -v / edge);
    }
    rect[0] = rect[1] = 0;
    rect[2] = columns;
    rect[3] = rows;
    if (behind === 8 || outside.includes(8)) {
      rect[2] = rect[3] = 0;
      return;
    }
    if (behind > 0 && !rays.parallel) return;
    // Pixel i has its centre at the view coordinate x for which 2i + 1 = (1 + x) · width. The margin is one pixel.
    const first = (/** @type {number} */ at, /** @type {number} */ pixels) => Math.floor((0.5 * ((1 + at) * pixels - 1) - 1) / BLOCK);
    const last = (/** @type {number} */ at, /** @type {number} */ pixels) => Math.floor((0.5 * ((1 + at) * pixels - 1) + 1) / BLOCK) + 1;
    rect[0] = Math.min(Math.max(first(x0, width), 0), columns);
    rect[1] = Math.min(Math.max(first(y0, height), 0), rows);
    rect[2] = Math.min(Math.max(last(x1, width), 0), columns);
    rect[3] = Math.min(Math.max(last(y1, height), 0), rows);
  };

  /** A lower bound of the length along any ray from its start to a box. */
  const distance = (/** @type {number} */ x, /** @type {number} */ y, /** @type {number} */ z, /** @type {number} */ size) => {
    const box = [x, y, z];
    let sum = 0;
    if (rays.parallel) {
      for (let a = 0; a < 3; ++a)
        sum += (rays.forward[a] * (box[a] + 0.5 * size - eye[a]) - Math.abs(rays.forward[a]) * 0.5 * size) * toWorld[a];
      return Math.max(sum, 0) * (1 - 1e-6);
    }
    for (let a = 0; a < 3; ++a) {
      const away = (Math.min(Math.max(eye[a], box[a]), box[a] + size) - eye[a]) * toWorld[a];
      sum += away * away;
    }
    return Math.sqrt(sum) * (1 - 1e-6);
  };

  /**
   * @param {number} node
   * @param {number} x
   * @param {number} y
   * @param {number} z
   * @param {number} size
   */
  const mark = (node, x, y, z, size) => {
    const above = bounds.low[node] > offset;
    const below = bounds.high[node] < offset;
    if (side > 0 ? above : below) return;
    project(x, y, z, size);
    const [x0, y0, x1, y1] = rect;
    if (x0 >= x1 || y0 >= y1) return;
    if (above || below || isLeaf(field, node) || (x1 - x0 <= 1 && y1 - y0 <= 1)) {
      const start = distance(x, y, z, size);
      for (let row = y0; row < y1; ++row)
        for (let column = x0; column < x1; ++column) {
          const at = row * columns + column;
          if (start < starts[at]) starts[at] = start;
        }
      return;
    }
    const half = 0.5 * size;
    for (let child = 0; child < 8; ++child)
      mark(field.low[node] + child, x + (child & 1 ? half : 0), y + (child & 2 ? half : 0), z + (child & 4 ? half : 0), half);
  };

  let base = 0;
  for (let z = 0; z < field.grid[2]; ++z)
    for (let y = 0; y < field.grid[1]; ++y) for (let x = 0; x < field.grid[0]; ++x) mark(base++, x, y, z, 1);
  const blocks = [];
  for (let row = 0; row < rows; ++row)
    for (let column = 0; column < columns; ++column) {
      const start = starts[row * columns + column];
      if (start < Infinity) blocks.push(BLOCK * column, BLOCK * row, start);
    }
  return { side, blocks: new Float32Array(blocks) };
}
