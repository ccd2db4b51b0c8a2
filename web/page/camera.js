// Cameras and slices, as the program has them (hpsdf/render/view.h).

import { add, cross, dot, normalized, scaled, subtract } from "./vector.js";

/** @typedef {import("./field_file.js").Field} Field */
/** @typedef {import("./field_file.js").Vector} Vector */

/**
 * A camera that looks at a target.
 * @typedef {object} Orbit
 * @property {number} azimuth  degrees
 * @property {number} elevation  degrees
 * @property {number} distance  in domain diagonals
 * @property {Vector} target  in the field's units
 * @property {boolean} parallel
 * @property {boolean} upZ
 */

/**
 * The rays of a picture: that of the point (u, v) in [−1, 1]², v upwards, starts at the eye and runs along forward + u · right +
 * v · up or, if rays are parallel, starts at eye + u · right + v · up and runs along forward. Lengths are in the field's units.
 * @typedef {{eye: Vector, forward: Vector, right: Vector, up: Vector, parallel: boolean}} Rays
 */

const HALF_FIELD_OF_VIEW = Math.tan((0.5 * 35 * Math.PI) / 180);
const RAY_MARGIN = 0.01;

/**
 * @param {Field} field
 */
export function diagonalOf(field) {
  return Math.hypot(...field.size);
}

/**
 * @param {Field} field
 * @returns {Vector}
 */
export function centreOf(field) {
  return add(field.lower, scaled(field.size, 0.5));
}

/**
 * @param {Orbit} orbit
 * @param {Field} field
 * @param {number} aspect  width over height
 * @returns {Rays}
 */
export function raysOf(orbit, field, aspect) {
  const azimuth = (orbit.azimuth * Math.PI) / 180;
  const elevation = (orbit.elevation * Math.PI) / 180;
  /** @type {Vector} */
  const vertical = orbit.upZ ? [0, 0, 1] : [0, 1, 0];
  /** @type {Vector} */
  const front = orbit.upZ ? [0, -1, 0] : [0, 0, 1];
  const outward = add([Math.sin(azimuth), 0, 0], scaled(front, Math.cos(azimuth)));
  const side = subtract([Math.cos(azimuth), 0, 0], scaled(front, Math.sin(azimuth)));
  const towardsEye = add(scaled(outward, Math.cos(elevation)), scaled(vertical, Math.sin(elevation)));
  const above = subtract(scaled(vertical, Math.cos(elevation)), scaled(outward, Math.sin(elevation)));
  const distance = orbit.distance * diagonalOf(field);
  const reach = HALF_FIELD_OF_VIEW * (orbit.parallel ? distance : 1);
  let eye = add(orbit.target, scaled(towardsEye, distance));
  if (orbit.parallel) {
    const toCorner = dot(subtract(centreOf(field), orbit.target), towardsEye) + 0.5 * dot(field.size, /** @type {Vector} */ (towardsEye.map(Math.abs)));
    eye = add(orbit.target, scaled(towardsEye, toCorner + RAY_MARGIN * diagonalOf(field)));
  }
  return { eye, forward: scaled(towardsEye, -1), right: scaled(side, reach * aspect), up: scaled(above, reach), parallel: orbit.parallel };
}

/**
 * A plane that is seen flat: the point (u, v) in [−1, 1]² shows origin + u · right + v · up.
 * @typedef {{origin: Vector, right: Vector, up: Vector}} Plane
 */

/**
 * Returns right and up vectors for a plane with this unit normal.
 * @param {Vector} normal
 * @returns {[Vector, Vector]}
 */
export function screenAxes(normal) {
  /** @type {Vector} */
  const away = Math.abs(normal[2]) < 0.9 ? [0, 0, 1] : [0, 1, 0];
  const right = normalized(cross(away, normal));
  return [right, cross(normal, right)];
}
