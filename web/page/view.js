// The view holds what a page shows, as values that the controls change.

import { centreOf } from "./camera.js";
import { subtract } from "./vector.js";

/** @typedef {import("./field_file.js").Field} Field */
/** @typedef {import("./field_file.js").Vector} Vector */
/** @typedef {import("./camera.js").Orbit} Orbit */
/** @typedef {import("./camera.js").Plane} Plane */

/** @typedef {"normal" | "degree" | "depth" | "distance"} Quantity */

/**
 * @typedef {object} View
 * @property {"surface" | "slice"} kind
 * @property {Orbit} orbit
 * @property {number} offset  of the surface
 * @property {0 | 1 | 2} axis  of the slice
 * @property {number} at  the slice's coordinate along its axis
 * @property {number} zoom
 * @property {Vector} middle  the point in the middle of a slice
 * @property {Quantity} surfaceColor
 * @property {Quantity} sliceColor
 */

/**
 * The view of a field that has just been opened.
 * @param {Field} field
 * @returns {View}
 */
export function firstView(field) {
  const middle = centreOf(field);
  return {
    kind: "surface",
    orbit: { azimuth: 30, elevation: 20, distance: 1.1, target: middle, parallel: false, upZ: false },
    offset: 0,
    axis: 2,
    at: middle[2],
    zoom: 1,
    middle,
    surfaceColor: "normal",
    sliceColor: "degree",
  };
}

/**
 * The axes of a picture of a slice: to the right and upwards.
 * @param {0 | 1 | 2} axis
 * @returns {[number, number]}
 */
export function axesOfSlice(axis) {
  return [axis === 0 ? 1 : 0, axis === 2 ? 1 : 2];
}

/**
 * Returns the plane that a slice shows in a picture of this size.
 * @param {View} view
 * @param {Field} field
 * @param {number} width
 * @param {number} height
 * @returns {Plane}
 */
export function planeOf(view, field, width, height) {
  const [across, upward] = axesOfSlice(view.axis);
  const margin = 1.05;
  const unit = Math.max(field.size[across] / width, field.size[upward] / height) * (margin / 2 / view.zoom);
  /** @type {Vector} */
  const origin = [...view.middle];
  origin[view.axis] = view.at;
  /** @type {Vector} */
  const right = [0, 0, 0];
  /** @type {Vector} */
  const up = [0, 0, 0];
  right[across] = unit * width;
  up[upward] = unit * height;
  return { origin, right, up };
}

/**
 * Returns the lines of a script of the program that shows the same view.
 * @param {View} view
 * @param {Field} field
 */
export function scriptOf(view, field) {
  const number = (/** @type {number} */ x) => String(Number(x.toPrecision(9)));
  const vector = (/** @type {Vector} */ v) => v.map(number).join(",");
  const lines = [];
  if (view.kind === "surface") {
    const { azimuth, elevation, distance, target, parallel, upZ } = view.orbit;
    const moved = Math.hypot(...subtract(target, centreOf(field))) > 1e-9 * Math.hypot(...field.size);
    lines.push("show surface", `surface offset=${number(view.offset)}`);
    lines.push(`camera ${[azimuth, elevation, distance].map(number).join(",")}${moved ? ` target=${vector(target)}` : ""}${parallel ? " projection=orthographic" : ""}${upZ ? " up=z" : ""}`);
    lines.push(`color ${view.surfaceColor}`);
  } else {
    lines.push("show slice", `plane axis=${"xyz"[view.axis]} offset=${number(view.at)} zoom=${number(view.zoom)} target=${vector(view.middle)}`);
    lines.push(`color ${view.sliceColor}`);
  }
  return lines.join("\n");
}
