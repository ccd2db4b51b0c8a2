// Blocks of pixels whose rays may hit the surface, with a lower bound of the distance to it: only these are drawn. The program
// finds them in the same way (render/src/view/surface_blocks.h).

import { isLeaf } from "../field/field_file.js";
import { gridPoint } from "../field/query.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */
/** @typedef {import("./bounds.js").Bounds} Bounds */
/** @typedef {import("./camera.js").Rays} Rays */

export const BLOCK = 8; // pixels along each side of a block

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
 * @param {number} x
 * @param {number} least
 * @param {number} greatest
 */
function clampBetween(x, least, greatest) {
  return x < least ? least : x > greatest ? greatest : x;
}

/**
 * @param {number} block
 * @param {number} count
 */
function clampTo(block, count) {
  return clampBetween(block, 0, count);
}

/**
 * Returns the first block that has to do with the view coordinate `at`. Pixel i has its centre at the coordinate x for which
 * 2i + 1 = (1 + x) · pixels. The margin is one pixel.
 * @param {number} at
 * @param {number} pixels
 */
function firstBlock(at, pixels) {
  return Math.floor((0.5 * ((1 + at) * pixels - 1) - 1) / BLOCK);
}

/**
 * Returns the block behind the last one that has to do with the view coordinate `at`.
 * @param {number} at
 * @param {number} pixels
 */
function lastBlock(at, pixels) {
  return Math.floor((0.5 * ((1 + at) * pixels - 1) + 1) / BLOCK) + 1;
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

  // Thousands of boxes are projected for each picture: no array is made for one.
  const [depthRow, rightRow, upRow] = view;
  const [eyeX, eyeY, eyeZ] = eye;
  const [unitX, unitY, unitZ] = toWorld;
  const along = (/** @type {number[]} */ row, /** @type {number} */ x, /** @type {number} */ y, /** @type {number} */ z) => row[0] * x + row[1] * y + row[2] * z;

  /** The blocks that rays through a box may have: x0, y0, x1, y1, half-open. */
  const rect = [0, 0, 0, 0];
  /**
   * @param {number} x
   * @param {number} y
   * @param {number} z
   * @param {number} size
   */
  const project = (x, y, z, size) => {
    let x0 = Infinity, y0 = Infinity, x1 = -Infinity, y1 = -Infinity;
    let behind = 0, left = 0, right = 0, below = 0, above = 0;
    for (let i = 0; i < 8; ++i) {
      const dx = x - eyeX + (i & 1 ? size : 0), dy = y - eyeY + (i & 2 ? size : 0), dz = z - eyeZ + (i & 4 ? size : 0);
      const depth = along(depthRow, dx, dy, dz);
      const u = along(rightRow, dx, dy, dz);
      const v = along(upRow, dx, dy, dz);
      const edge = rays.parallel ? 1 : depth;
      if (u > edge) ++right;
      if (-u > edge) ++left;
      if (v > edge) ++above;
      if (-v > edge) ++below;
      if (!(depth > near)) {
        ++behind;
        if (!rays.parallel) continue;
      }
      const across = u / edge, down = -v / edge;
      if (across < x0) x0 = across;
      if (across > x1) x1 = across;
      if (down < y0) y0 = down;
      if (down > y1) y1 = down;
    }
    rect[0] = rect[1] = 0;
    rect[2] = columns;
    rect[3] = rows;
    if (behind === 8 || left === 8 || right === 8 || above === 8 || below === 8) {
      rect[2] = rect[3] = 0;
      return;
    }
    if (behind > 0 && !rays.parallel) return;
    rect[0] = clampTo(firstBlock(x0, width), columns);
    rect[1] = clampTo(firstBlock(y0, height), rows);
    rect[2] = clampTo(lastBlock(x1, width), columns);
    rect[3] = clampTo(lastBlock(y1, height), rows);
  };

  /**
   * Returns a lower bound of the length along any ray from its start to a box.
   * @param {number} x
   * @param {number} y
   * @param {number} z
   * @param {number} size
   */
  const distance = (x, y, z, size) => {
    if (rays.parallel) {
      const [fx, fy, fz] = rays.forward;
      const half = 0.5 * size;
      const toMiddle = fx * (x + half - eyeX) * unitX + fy * (y + half - eyeY) * unitY + fz * (z + half - eyeZ) * unitZ;
      const reach = half * (Math.abs(fx) * unitX + Math.abs(fy) * unitY + Math.abs(fz) * unitZ);
      return Math.max(toMiddle - reach, 0) * (1 - 1e-6);
    }
    const dx = (clampBetween(eyeX, x, x + size) - eyeX) * unitX;
    const dy = (clampBetween(eyeY, y, y + size) - eyeY) * unitY;
    const dz = (clampBetween(eyeZ, z, z + size) - eyeZ) * unitZ;
    return Math.sqrt(dx * dx + dy * dy + dz * dz) * (1 - 1e-6);
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
    const x0 = rect[0], y0 = rect[1], x1 = rect[2], y1 = rect[3];
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
