// Cameras and slices, as the program has them (hpsdf/render/view.h).

import { gridDirection, gridPoint } from "../field/query.js";
import { add, cross, dot, normalized, scaled, subtract } from "../field/vector.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */

/**
 * A camera that looks at a target.
 * @typedef {object} Orbit
 * @property {number} azimuth  degrees
 * @property {number} elevation  degrees
 * @property {number} distance  in domain diagonals
 * @property {Vector | null} target  in the field's units; null: the middle of the domain
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
const SECTION_MARGIN = 0.025; // around a slice, as a share of the picture's width or height

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
  const target = orbit.target ?? centreOf(field);
  const reach = HALF_FIELD_OF_VIEW * (orbit.parallel ? distance : 1);
  let eye = add(target, scaled(towardsEye, distance));
  if (orbit.parallel) {
    const toCorner = dot(subtract(centreOf(field), target), towardsEye) + 0.5 * dot(field.size, /** @type {Vector} */ (towardsEye.map(Math.abs)));
    eye = add(target, scaled(towardsEye, toCorner + RAY_MARGIN * diagonalOf(field)));
  }
  return { eye, forward: scaled(towardsEye, -1), right: scaled(side, reach * Math.max(aspect, 1)), up: scaled(above, reach * Math.max(1 / aspect, 1)), parallel: orbit.parallel };
}

/**
 * Returns the ray through the point (u, v) of the picture.
 * @param {Rays} rays
 * @param {number} u
 * @param {number} v
 * @returns {{start: Vector, direction: Vector}}  the direction has length 1
 */
export function rayThrough(rays, u, v) {
  const across = add(scaled(rays.right, u), scaled(rays.up, v));
  if (rays.parallel) return { start: add(rays.eye, across), direction: rays.forward };
  return { start: rays.eye, direction: normalized(add(rays.forward, across)) };
}

/**
 * A plane that is seen flat: the point (u, v) in [−1, 1]² shows origin + u · right + v · up.
 * @typedef {{origin: Vector, right: Vector, up: Vector}} Plane
 */

/**
 * Returns the unit vector along an axis.
 * @param {number} axis
 * @returns {Vector}
 */
export function axisVector(axis) {
  return /** @type {Vector} */ ([0, 1, 2].map((a) => (a === axis ? 1 : 0)));
}

/**
 * Returns the index of the axis to which a direction is parallel, or −1.
 * @param {Vector} direction
 */
export function axisAlong(direction) {
  return [0, 1, 2].findIndex((axis) => direction[(axis + 1) % 3] === 0 && direction[(axis + 2) % 3] === 0);
}

/**
 * Returns the unit vectors that point right and up in the picture of a plane with this unit normal. They do not depend on its sign.
 * @param {Vector} normal
 * @returns {[Vector, Vector]}
 */
export function screenAxes(normal) {
  /** @type {Vector} */
  const upwards = Math.abs(normal[2]) > 0.9 ? [0, 1, 0] : [0, 0, 1];
  const up = normalized(subtract(upwards, scaled(normal, dot(upwards, normal))));
  const right = normalized(cross(up, normal));
  const largest = right.reduce((best, x, axis) => (Math.abs(x) > Math.abs(right[best]) ? axis : best), 0);
  return [right[largest] < 0 ? scaled(right, -1) : right, up];
}

/**
 * Returns where a plane crosses the edges of the field's domain.
 * @param {Field} field
 * @param {Vector} point
 * @param {Vector} normal
 * @returns {Vector[]}
 */
function sectionCorners(field, point, normal) {
  const { lower, upper } = field;
  /** @type {Vector[]} */
  const corners = [];
  for (let axis = 0; axis < 3; ++axis)
    for (let edge = 0; edge < 4; ++edge) {
      /** @type {Vector} */
      const a = [...lower];
      if (edge & 1) a[(axis + 1) % 3] = upper[(axis + 1) % 3];
      if (edge & 2) a[(axis + 2) % 3] = upper[(axis + 2) % 3];
      /** @type {Vector} */
      const b = [...a];
      b[axis] = upper[axis];
      const da = dot(normal, subtract(a, point)), db = dot(normal, subtract(b, point));
      if (da * db > 0) continue;
      corners.push(da === db ? a : add(a, scaled(subtract(b, a), da / (da - db))));
    }
  return corners;
}

/**
 * Returns the plane as a picture of this size shows it at zoom 1: the whole section of the domain, with a margin.
 * @param {Field} field
 * @param {Vector} point
 * @param {Vector} normal  of length 1
 * @param {number} width
 * @param {number} height
 * @returns {Plane}
 */
export function sectionPlane(field, point, normal, width, height) {
  const axis = axisAlong(normal);
  if (axis >= 0) {
    // The same arithmetic as in the program, so that the same pixels lie on faces between cells.
    const across = axis === 0 ? 1 : 0, upward = axis === 2 ? 1 : 2;
    const { lower, upper } = field;
    return framed([lower[across], upper[across]], [lower[upward], upper[upward]], scaled(axisVector(axis), point[axis]), axisVector(across), axisVector(upward), width, height);
  }
  const [right, up] = screenAxes(normal);
  const centre = centreOf(field);
  const base = subtract(centre, scaled(normal, dot(normal, subtract(centre, point))));
  const corners = sectionCorners(field, point, normal);
  const least = 1e-9 * diagonalOf(field);
  return framed(extentAlong(corners, base, right, least), extentAlong(corners, base, up, least), base, right, up, width, height);
}

/**
 * Returns the plane of a picture that shows a rectangle of it with a margin.
 * @param {[number, number]} across  the rectangle's ends along `right`
 * @param {[number, number]} upward
 * @param {Vector} base
 * @param {Vector} right  of length 1
 * @param {Vector} up
 * @param {number} width
 * @param {number} height
 * @returns {Plane}
 */
function framed(across, upward, base, right, up, width, height) {
  const pixel = Math.max((across[1] - across[0]) / width, (upward[1] - upward[0]) / height) / (1 - 2 * SECTION_MARGIN);
  const origin = add(add(base, scaled(right, 0.5 * (across[0] + across[1]))), scaled(up, 0.5 * (upward[0] + upward[1])));
  return { origin, right: scaled(right, 0.5 * (pixel * width)), up: scaled(up, 0.5 * (pixel * height)) };
}

/**
 * Returns the point that a pixel of a picture of a plane shows, in grid coordinates, by the program's arithmetic.
 * @param {Field} field
 * @param {Plane} plane
 * @param {number} column
 * @param {number} row
 * @param {number} width
 * @param {number} height
 * @returns {Vector}
 */
export function gridPointOfPixel(field, plane, column, row, width, height) {
  const across = 2 * ((2 * column + 1 - width) * (0.5 / width)), upward = 2 * ((height - 2 * row - 1) * (0.5 / height));
  const right = scaled(gridDirection(field, plane.right), across);
  return add(add(gridPoint(field, plane.origin), right), scaled(gridDirection(field, plane.up), upward));
}

/**
 * Returns the least and the greatest coordinates of points along a direction, at least `least` apart.
 * @param {Vector[]} points
 * @param {Vector} base
 * @param {Vector} direction
 * @param {number} least
 * @returns {[number, number]}
 */
function extentAlong(points, base, direction, least) {
  const along = points.map((point) => dot(direction, subtract(point, base)));
  const low = Math.min(...along), high = Math.max(...along);
  return points.length > 0 && high - low >= least ? [low, high] : [-0.5 * least, 0.5 * least];
}
