// The view holds what a page shows, as values that the controls change. It is written as lines of a script of the program, and read
// from such lines.

import { axisAlong, axisVector, centreOf, diagonalOf, sectionPlane } from "./camera.js";
import { add, dot, normalized, scaled, subtract } from "../field/vector.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */
/** @typedef {import("./camera.js").Orbit} Orbit */
/** @typedef {import("./camera.js").Plane} Plane */

/** @typedef {"normal" | "degree" | "depth" | "distance" | "value-jump" | "gradient-jump" | "cell-error"} Quantity */

/**
 * @typedef {object} View
 * @property {"surface" | "slice"} kind
 * @property {Orbit} orbit
 * @property {number} offset  of the surface
 * @property {{axis: number, at: number} | null} clip  the plane that cuts the surface open
 * @property {Vector} point  a point of the slice's plane
 * @property {Vector} normal  of the slice's plane, of length 1; exactly along an axis where it is meant so
 * @property {boolean} planeInSpace  whether the plane stands in the picture of the surface too
 * @property {Vector | null} target  the point in the middle of a slice; null: the middle of the section
 * @property {number} zoom  of the slice
 * @property {string} cells  whose edges stand in the picture of the surface: none, all, or depths with commas between them
 * @property {Quantity} surfaceColor
 * @property {Quantity} sliceColor
 * @property {Vector | null} mark  a point to which the picture points
 */

/** An error in the text of a view. */
export class ViewError extends Error {}

/**
 * Returns the middle of the box around the surface, rounded to four digits of the box's size, where planes stand at first.
 * @param {Field} field
 * @returns {Vector}
 */
export function middleOf(field) {
  const [lower, upper] = field.box;
  return /** @type {Vector} */ (
    lower.map((x, axis) => {
      const middle = 0.5 * (x + upper[axis]), size = upper[axis] - x;
      if (!(size > 0)) return middle;
      const power = 10 ** (3 - Math.floor(Math.log10(size)));
      return Math.round(middle * power) / power + 0;
    })
  );
}

/**
 * Returns the view of a field that has just been opened.
 * @param {Field} field
 * @returns {View}
 */
export function firstView(field) {
  return {
    kind: "surface",
    orbit: { azimuth: 30, elevation: 20, distance: 1.1, target: null, parallel: false, upZ: false },
    offset: 0,
    clip: null,
    point: middleOf(field),
    normal: axisVector(2),
    planeInSpace: false,
    target: null,
    zoom: 1,
    cells: "none",
    surfaceColor: "normal",
    sliceColor: "degree",
    mark: null,
  };
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
  const { origin, right, up } = sectionPlane(field, view.point, view.normal, width, height);
  let middle = origin;
  if (view.target)
    for (const side of [right, up]) middle = add(middle, scaled(side, dot(side, subtract(view.target, middle)) / dot(side, side)));
  const axis = axisAlong(view.normal);
  if (axis >= 0) middle[axis] = view.point[axis];
  return { origin: middle, right: scaled(right, 1 / view.zoom), up: scaled(up, 1 / view.zoom) };
}

/**
 * Returns the place of the slice's plane: its coordinate on its axis, or its distance from the domain's centre if it is oblique.
 * @param {View} view
 * @param {Field} field
 */
export function placeOfPlane(view, field) {
  const axis = axisAlong(view.normal);
  return axis >= 0 ? view.point[axis] : dot(view.normal, subtract(view.point, centreOf(field)));
}

/**
 * Moves the slice's plane to a place, which is kept within the domain.
 * @param {View} view
 * @param {Field} field
 * @param {number} place  as placeOfPlane has it
 */
export function movePlaneTo(view, field, place) {
  const [least, greatest] = placesOfPlane(view, field);
  const at = within(place, [least, greatest]);
  const axis = axisAlong(view.normal);
  view.point = axis >= 0 ? /** @type {Vector} */ (view.point.map((x, a) => (a === axis ? at : x))) : add(centreOf(field), scaled(view.normal, at));
}

/**
 * Returns the least and the greatest place at which the slice's plane meets the domain.
 * @param {View} view
 * @param {Field} field
 * @returns {[number, number]}
 */
export function placesOfPlane(view, field) {
  const axis = axisAlong(view.normal);
  if (axis >= 0) return [field.lower[axis], field.upper[axis]];
  const reach = 0.5 * view.normal.reduce((sum, x, a) => sum + Math.abs(x) * field.size[a], 0);
  return [-reach, reach];
}

/**
 * @param {number} x
 */
function numberText(x) {
  return String(Number(x.toPrecision(9)));
}

/**
 * @param {readonly number[]} v
 */
function vectorText(v) {
  return v.map(numberText).join(",");
}

/**
 * @param {View} view
 */
function planeLine(view) {
  const axis = axisAlong(view.normal);
  const place = axis >= 0 ? `axis=${"xyz"[axis]} offset=${numberText(view.point[axis])}` : `through=${vectorText([...view.point, ...view.normal])}`;
  return `plane ${place} in-space=${view.planeInSpace} zoom=${numberText(view.zoom)} target=${view.target ? vectorText(view.target) : "center"}`;
}

/**
 * @param {View} view
 */
function surfaceLine({ offset, clip }) {
  const cut = clip ? `clip=${"xyz"[clip.axis]} clip-offset=${numberText(clip.at)}` : "clip=none";
  return `surface offset=${numberText(offset)} ${cut}`;
}

/**
 * @param {View} view
 */
function cameraLine({ orbit }) {
  const { azimuth, elevation, distance, target, parallel, upZ } = orbit;
  const projection = parallel ? "orthographic" : "perspective";
  return `camera ${vectorText([azimuth, elevation, distance])} target=${target ? vectorText(target) : "center"} up=${upZ ? "z" : "y"} projection=${projection}`;
}

/**
 * Returns the lines of a script of the program that shows the same view.
 * @param {View} view
 * @param {Field} field
 */
export function scriptOf(view, field) {
  const cells = view.cells === "none" ? "cells none" : `cells lines depths=${view.cells}`;
  return [
    `show ${view.kind}`,
    cameraLine(view),
    surfaceLine(view),
    planeLine(view),
    cells,
    `color ${view.surfaceColor} of=surface`,
    `color ${view.sliceColor} of=slice`,
    `worst mark=${view.mark ? vectorText(view.mark) : "none"}`,
  ].join("\n");
}

/** The words of a command in a script: those without a name, and those with one. */
class Words {
  /**
   * @param {string} line
   */
  constructor(line) {
    const words = line.trim().split(/\s+/);
    this.command = words[0];
    this.line = line.trim();
    this.plain = words.slice(1).filter((word) => !word.includes("="));
    this.named = new Map(words.filter((word) => word.includes("=")).map((word) => [word.slice(0, word.indexOf("=")), word.slice(word.indexOf("=") + 1)]));
  }

  /**
   * Returns numbers with commas between them.
   * @param {string} text
   * @param {number} count
   */
  numbers(text, count) {
    const numbers = text.split(",").map((word) => (word.trim() === "" ? NaN : Number(word)));
    if (numbers.length !== count || !numbers.every(Number.isFinite)) throw new ViewError(`“${this.line}”: “${text}” is not ${count === 1 ? "a number" : `${count} numbers with commas`}`);
    return numbers;
  }

  /**
   * Returns the levels that a list of numbers and ranges such as 0-3,5 names, in rising order.
   * @param {string} text
   */
  levels(text) {
    const levels = text.split(",").flatMap((part) => {
      const [first, last] = /^\d+(-\d+)?$/.test(part) ? part.split("-").map(Number) : [NaN];
      if (!(first >= 0 && (last ?? first) - first <= 30)) throw new ViewError(`“${this.line}”: “${part}” is no depth and no range of depths`);
      return Array.from({ length: Math.max((last ?? first) - first + 1, 0) }, (_, n) => first + n);
    });
    return [...new Set(levels)].sort((a, b) => a - b);
  }

  /**
   * Calls `set` with the numbers of a name if it is given, or with null if it has the word `none`.
   * @param {string} name
   * @param {number} count
   * @param {string} none
   * @param {(numbers: number[] | null) => void} set
   */
  whenNumbers(name, count, none, set) {
    const text = this.named.get(name);
    if (text !== undefined) set(text === none ? null : this.numbers(text, count));
  }

  /**
   * Calls `set` with the word of a name if it is given; it has to be one of `words`.
   * @param {string} name
   * @param {readonly string[]} words
   * @param {(word: string) => void} set
   */
  whenWord(name, words, set) {
    const word = this.named.get(name);
    if (word === undefined) return;
    if (!words.includes(word)) throw new ViewError(`“${this.line}”: ${name} is one of ${words.join(", ")}`);
    set(word);
  }
}

/** The least and the greatest distance of the eye from its target, in diagonals of the domain, and zoom of a slice. */
export const DISTANCES = /** @type {const} */ ([0.01, 20]);
export const ZOOMS = /** @type {const} */ ([0.5, 1e5]);

/**
 * @param {number} x
 * @param {readonly [number, number]} range
 */
export function within(x, [least, greatest]) {
  return Math.min(Math.max(x, least), greatest);
}

const AXES = ["x", "y", "z"];
const QUANTITIES = ["normal", "degree", "depth", "distance", "value-jump", "gradient-jump", "cell-error"];
/** Commands of scripts about views that mean nothing to the page. */
const IGNORED = ["panel", "triangles", "arrows", "beside", "load", "shot"];

/**
 * What each command of a script does to a view.
 * @type {Record<string, (words: Words, view: View, field: Field) => void>}
 */
const COMMANDS = {
  show(words, view) {
    const [kind] = words.plain;
    if (kind !== "surface" && kind !== "slice") throw new ViewError(`“${words.line}”: show surface or slice`);
    view.kind = kind;
  },
  camera(words, view) {
    const { orbit } = view;
    if (words.plain.length > 0) [orbit.azimuth, orbit.elevation, orbit.distance] = words.numbers(words.plain[0], 3);
    orbit.elevation = within(orbit.elevation, [-90, 90]);
    orbit.distance = within(orbit.distance, DISTANCES);
    words.whenNumbers("target", 3, "center", (target) => (orbit.target = /** @type {Vector | null} */ (target)));
    words.whenWord("up", ["y", "z"], (word) => (orbit.upZ = word === "z"));
    words.whenWord("projection", ["perspective", "orthographic"], (word) => (orbit.parallel = word === "orthographic"));
  },
  surface(words, view, field) {
    words.whenNumbers("offset", 1, "", (offset) => (view.offset = within(offset ? offset[0] : 0, [-diagonalOf(field), diagonalOf(field)])));
    words.whenWord("clip", ["none", ...AXES], (word) => {
      const axis = AXES.indexOf(word);
      view.clip = axis < 0 ? null : { axis, at: middleOf(field)[axis] };
    });
    words.whenNumbers("clip-offset", 1, "", (at) => view.clip && at && (view.clip.at = within(at[0], [field.lower[view.clip.axis], field.upper[view.clip.axis]])));
  },
  plane(words, view, field) {
    words.whenWord("axis", AXES, (word) => {
      view.normal = axisVector(AXES.indexOf(word));
      view.point = middleOf(field);
    });
    words.whenNumbers("offset", 1, "auto", (at) => movePlaneTo(view, field, at ? at[0] : placeOfPlane({ ...view, point: middleOf(field) }, field)));
    words.whenNumbers("through", 6, "", (numbers) => {
      const [x, y, z, ...normal] = numbers ?? [];
      if (!(Math.hypot(...normal) > 0)) throw new ViewError(`“${words.line}”: the normal is zero`);
      setPlane(view, field, [x, y, z], /** @type {Vector} */ (normal));
    });
    words.whenWord("in-space", ["true", "false"], (word) => (view.planeInSpace = word === "true"));
    words.whenNumbers("zoom", 1, "", (zoom) => (view.zoom = within(zoom ? zoom[0] : 1, ZOOMS)));
    words.whenNumbers("target", 3, "center", (target) => (view.target = /** @type {Vector | null} */ (target)));
  },
  cells(words, view) {
    const depths = words.named.get("depths") ?? "all";
    if (words.plain[0] === "none") view.cells = "none";
    else if (words.plain[0] === "lines" || words.plain.length === 0) view.cells = depths === "all" ? "all" : words.levels(depths).join(",");
    else throw new ViewError(`“${words.line}”: the page draws cells by lines`);
  },
  color(words, view) {
    const [quantity] = words.plain;
    if (!QUANTITIES.includes(quantity)) throw new ViewError(`“${words.line}”: the page colours by ${QUANTITIES.join(", ")}`);
    const of = words.named.get("of") ?? view.kind;
    if (quantity === (of === "slice" ? "normal" : "distance")) throw new ViewError(`“${words.line}”: normal is for surfaces, distance for slices`);
    if (of === "slice") view.sliceColor = /** @type {Quantity} */ (quantity);
    else view.surfaceColor = /** @type {Quantity} */ (quantity);
  },
  worst(words, view) {
    words.whenNumbers("mark", 3, "none", (mark) => (view.mark = /** @type {Vector | null} */ (mark)));
  },
};

/**
 * Lays the slice's plane through a point. A normal along an axis becomes exactly that axis.
 * @param {View} view
 * @param {Field} field
 * @param {Vector} point
 * @param {Vector} normal  of any length above 0
 */
export function setPlane(view, field, point, normal) {
  const axis = axisAlong(normal);
  const largest = Math.max(...normal.map(Math.abs));
  view.normal = axis >= 0 ? axisVector(axis) : normalized(/** @type {Vector} */ (normal.map((x) => x / largest)));
  view.point = point;
  movePlaneTo(view, field, placeOfPlane(view, field));
}

/**
 * Returns the normal that a choice of the slice's axis stands for: x, y or z, or else the plane's own normal, tilted if it lies along an
 * axis, so that it can be seen to be oblique.
 * @param {string} choice
 * @param {View} view
 * @returns {Vector}
 */
export function normalFor(choice, view) {
  const axis = AXES.indexOf(choice);
  if (axis >= 0) return axisVector(axis);
  const own = axisAlong(view.normal);
  return own < 0 ? view.normal : normalized(/** @type {Vector} */ ([0, 1, 2].map((a) => (a === own ? 1 : a === (own + 1) % 3 ? 0.5 : 0.25))));
}

/**
 * Brings the planes of a view into the domain of another field than the one that it was made for.
 * @param {View} view
 * @param {Field} field
 */
export function fitPlanes(view, field) {
  const [least, greatest] = placesOfPlane(view, field);
  const place = placeOfPlane(view, field);
  if (!(place >= least && place <= greatest)) view.point = middleOf(field);
  if (!view.clip) return;
  const { axis, at } = view.clip;
  if (!(at >= field.lower[axis] && at <= field.upper[axis])) view.clip.at = middleOf(field)[axis];
}

/**
 * Returns the view that lines of a script show, from another view for what they do not tell, with a sentence about each line that the
 * page does not understand.
 * @param {string} text
 * @param {View} before
 * @param {Field} field
 * @returns {{view: View, problems: string[]}}
 */
export function viewFrom(text, before, field) {
  const view = structuredClone(before);
  const problems = [];
  for (const line of text.split(/[;\n]/)) {
    const words = new Words(line.replace(/#.*/, ""));
    if (words.command === "" || IGNORED.includes(words.command)) continue;
    const attempt = structuredClone(view);
    try {
      const command = Object.hasOwn(COMMANDS, words.command) && COMMANDS[words.command];
      if (!command) throw new ViewError(`“${words.line}”: the page does not know “${words.command}”`);
      command(words, attempt, field);
      Object.assign(view, attempt);
    } catch (error) {
      if (!(error instanceof ViewError)) throw error;
      problems.push(error.message);
    }
  }
  return { view, problems };
}
