// Lengths in a field: the distance between two points, and the thickness of the body at a point of its surface.

import { blendDifference } from "../field/blend.js";
import { isExact } from "../field/field_file.js";
import { piecesAlong, pointBetween } from "./line_probe.js";
import { evaluateIn, gridPoint, query } from "../field/query.js";
import { add, length, normalized, scaled, subtract } from "../field/vector.js";

/** @typedef {import("../drawing/bounds.js").Bounds} Bounds */
/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */
/** @typedef {import("../field/leaves.js").OctreeNode} OctreeNode */

/** The shortest step of the search for the other side of a body, as a part of a cell's edge. A narrower gap may be missed. */
const SHORTEST_STEP = 1e-4;

/**
 * Returns a bound of the length of the gradient of a leaf's function, by which steps are safe.
 * @param {Field} field
 * @param {Bounds} bounds
 * @param {OctreeNode} leaf
 */
function steepestIn(field, bounds, { node, depth }) {
  if (isExact(field, node)) return 1;
  const toWorld = field.size.map((x, a) => (2 * field.grid[a] * 2 ** depth) / x);
  const linear = Math.hypot(...toWorld.map((scale, a) => scale * bounds.linear[4 * node + a]));
  return linear + Math.max(...toWorld) * bounds.gradient[node];
}

/**
 * Returns the thickness at a point of the surface f = offset: the length of the way along the inward normal, −∇f, to the place where
 * the way leaves the body. Returns null if it leaves the domain first.
 * @param {Field} field
 * @param {Bounds} bounds
 * @param {Vector} point
 * @param {number} offset
 * @returns {number | null}
 */
export function thicknessAt(field, bounds, point, offset) {
  const found = query(field, point);
  if (!found || !(length(found.gradient) > 0)) return null;
  const reach = 2 * Math.hypot(...field.size); // beyond the domain
  const end = add(point, scaled(normalized(found.gradient), -reach));
  let isInside = false; // rounding may place the point a little outside
  let before = 0; // the value at the end of the piece before
  for (const { leaf, enter, leave } of piecesAlong(field, point, end)) {
    if (!leaf) continue;
    const valueAt = (/** @type {number} */ s) => evaluateIn(field, leaf, gridPoint(field, pointBetween(point, end, s / reach))).value - offset;
    const shortest = (SHORTEST_STEP * Math.min(...field.size.map((x, a) => x / field.grid[a]))) / 2 ** leaf.depth;
    const steepest = steepestIn(field, bounds, leaf);
    const blending = 2 * blendDifference(field, leaf.node); // at both ends of a step
    const last = leave * reach;
    let s = enter * reach;
    let value = valueAt(s);
    if (isInside && value >= 0) {
      if (value - before < s) return s;
      isInside = false; // the surface is torn beside the point itself
    }
    for (; s < last; value = before) {
      isInside ||= value < 0;
      const next = Math.min(s + Math.max((Math.abs(value) - blending) / steepest, shortest), last);
      before = valueAt(next);
      if (isInside && before >= 0) return crossingBetween(valueAt, s, next);
      s = next;
    }
  }
  return null;
}

/**
 * Returns where a function that is negative at the lower end and not at the upper one changes its sign, by bisection.
 * @param {(s: number) => number} valueAt
 * @param {number} lower
 * @param {number} upper
 */
function crossingBetween(valueAt, lower, upper) {
  for (;;) {
    const middle = (lower + upper) / 2;
    if (middle <= lower || middle >= upper) return upper;
    if (valueAt(middle) < 0) lower = middle;
    else upper = middle;
  }
}

/**
 * Returns the distance between two points with its components.
 * @param {Vector} from
 * @param {Vector} to
 */
export function distanceBetween(from, to) {
  const components = subtract(to, from);
  return { distance: length(components), components };
}
