// The point of a field that a pixel of a picture shows, in double precision.

import { gridPointOfPixel, rayThrough } from "./camera.js";
import { isSectionShown } from "./painter.js";
import { NO_CELL } from "./renderer.js";
import { query, queryGrid, worldPoint } from "../field/query.js";
import { add, dot, scaled } from "../field/vector.js";
import { planeOf } from "./view.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */
/** @typedef {import("./painter.js").Drawing} Drawing */
/** @typedef {import("../field/query.js").ValueAndGradient} ValueAndGradient */
/** @typedef {import("../field/query.js").LeafPoint} LeafPoint */

/** @typedef {ValueAndGradient & {point: Vector, leaf: LeafPoint, onSurface: boolean}} Pick */

const MOST_REFINEMENTS_OF_PICK = 8;

/**
 * Returns what a pixel shows, or null for the background.
 * @param {Field} field
 * @param {Drawing} drawing
 * @param {number} x  from 0 at the left to 1
 * @param {number} y  from 0 at the top to 1
 * @returns {Pick | null}
 */
export function pickAt(field, drawing, x, y) {
  const { hits, view } = drawing;
  const column = Math.min(Math.floor(x * hits.width), hits.width - 1);
  const row = Math.min(Math.floor(y * hits.height), hits.height - 1);
  if (view.kind === "slice") {
    const plane = planeOf(view, field, hits.width, hits.height);
    const grid = gridPointOfPixel(field, plane, column, row, hits.width, hits.height);
    const found = queryGrid(field, grid);
    return found && { ...found, point: worldPoint(field, grid), onSurface: false };
  }
  const u = (2 * column + 1) / hits.width - 1;
  const v = 1 - (2 * row + 1) / hits.height;
  const texel = hits.at(column, row);
  const cut = drawing.section?.at(column, row) ?? null;
  const ray = rayThrough(drawing.rays, u, v);
  if (cut && isSectionShown(cut, texel)) return pickOf(field, add(ray.start, scaled(ray.direction, cut.distance)), false);
  if (texel.cell === NO_CELL) return null;
  const length = refinedLength(field, ray, texel.distance, view.offset);
  return pickOf(field, add(ray.start, scaled(ray.direction, length)), true);
}

/**
 * @param {Field} field
 * @param {Vector} point
 * @param {boolean} onSurface
 * @returns {Pick | null}
 */
function pickOf(field, point, onSurface) {
  const found = query(field, point);
  return found && { ...found, point, onSurface };
}

/**
 * Returns the length of a ray up to the surface, from what single precision found, by Newton's method within the leaf there.
 * @param {Field} field
 * @param {{start: Vector, direction: Vector}} ray
 * @param {number} first
 * @param {number} offset
 */
function refinedLength(field, ray, first, offset) {
  const at = (/** @type {number} */ t) => query(field, add(ray.start, scaled(ray.direction, t)));
  const leaf = at(first)?.leaf.node;
  const most = 1e-5 * Math.hypot(...field.size);
  let t = first;
  for (let n = 0; n < MOST_REFINEMENTS_OF_PICK; ++n) {
    const here = at(t);
    if (!here || here.leaf.node !== leaf) return first;
    const step = (offset - here.value) / dot(here.gradient, ray.direction);
    if (!(Math.abs(t + step - first) < most)) return first;
    t += step;
    if (Math.abs(step) < 1e-15 * Math.hypot(...field.size)) break;
  }
  return at(t)?.leaf.node === leaf ? t : first;
}
