// The panels beside the picture: the legend, what is under the pointer, figures of the field.

import { cssColor, divergingColor, letterColor, orderedColor } from "../drawing/colors.js";
import { element, setRows, shortNumber } from "./dom.js";
import { EXACT_DEGREE, degreeOf, isExact, isLeaf } from "../field/field_file.js";
import { query } from "../field/query.js";
import { FaceMeter } from "../questions/jumps.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */
/** @typedef {import("../drawing/painter.js").Levels} Levels */
/** @typedef {import("../drawing/painter.js").Painter} Painter */
/** @typedef {import("../drawing/pick.js").Pick} Pick */
/** @typedef {import("../drawing/view.js").View} View */
/** @typedef {import("../drawing/view.js").Quantity} Quantity */

/** @type {Record<Quantity, string>} */
const TITLES = {
  normal: "surface",
  degree: "polynomial degree",
  depth: "octree depth",
  distance: "distance",
  "value-jump": "greatest jump of the value",
  "gradient-jump": "greatest jump of the gradient",
  "cell-error": "estimated RMS error of the cell",
};

/**
 * @param {View} view
 * @param {Painter} painter
 */
export function showLegend(view, painter) {
  const quantity = view.kind === "slice" ? view.sliceColor : view.surfaceColor;
  const legend = element("legend", HTMLDivElement);
  element("legend-title", HTMLElement).textContent = TITLES[quantity];
  if (quantity === "normal") legend.replaceChildren();
  else if (quantity === "value-jump" || quantity === "gradient-jump" || quantity === "cell-error") showScaleOfCells(legend, painter, quantity);
  else if (quantity === "distance") legend.replaceChildren(...scaleBar((t) => divergingColor(2 * t - 1), [-painter.range, 0, painter.range].map(shortNumber)));
  else legend.replaceChildren(...levelRows(quantity === "degree" ? painter.degrees : painter.depths));
}

/**
 * Returns a bar of a continuous scale, with numbers below it.
 * @param {(t: number) => import("../drawing/colors.js").Color} colorAt  for t from 0 to 1
 * @param {string[]} numbers
 */
export function scaleBar(colorAt, numbers) {
  const bar = document.createElement("div");
  bar.className = "bar";
  const stops = Array.from({ length: 17 }, (_, i) => cssColor(colorAt(i / 16)));
  bar.style.background = `linear-gradient(to right, ${stops.join(", ")})`;
  const ends = document.createElement("div");
  ends.className = "ends";
  for (const number of numbers) {
    const end = document.createElement("span");
    end.textContent = number;
    ends.append(end);
  }
  return [bar, ends];
}

/**
 * Shows the logarithmic scale of a quantity of which each cell has one number, once the numbers are known.
 * @param {HTMLElement} legend
 * @param {Painter} painter
 * @param {Quantity} quantity
 */
function showScaleOfCells(legend, painter, quantity) {
  const decades = painter.decadesOf(quantity);
  if (!decades) return legend.replaceChildren("being measured …");
  const [low, high] = decades;
  const grey = document.createElement("small");
  grey.textContent = quantity === "cell-error" ? "grey: zero, as in exact cells" : "grey: none";
  legend.replaceChildren(...scaleBar(orderedColor, Array.from({ length: high - low + 1 }, (_, n) => `1e${low + n}`.replace("-", "−"))), grey);
}

/**
 * Returns a row for each level, from the highest down: its colour and its share of the volume.
 * @param {Levels} levels
 */
function levelRows(levels) {
  const most = Math.max(...levels.map(({ share }) => share));
  return [...levels].reverse().map(({ level, share, color }) => {
    const row = document.createElement("div");
    row.className = "level";
    const name = document.createElement("b");
    name.textContent = level === EXACT_DEGREE ? "exact" : String(level);
    name.style.background = cssColor(color);
    name.style.color = letterColor(color);
    const percent = document.createElement("span");
    percent.textContent = `${(100 * share).toFixed(1)} %`;
    const bar = document.createElement("i");
    bar.style.width = `${(100 * share) / most}%`;
    row.append(name, percent, bar);
    return row;
  });
}

/**
 * @param {Field} field
 */
export function showFigures(field) {
  let leaves = 0;
  for (let n = 0; n < field.low.length; ++n) leaves += isLeaf(field, n) ? 1 : 0;
  /** @type {[string, string][]} */
  const rows = [["made from", field.name || "a function"], ["cells", leaves.toLocaleString("en")], ["file", `${(field.bytes / 1e6).toFixed(2)} MB`], ["domain", field.size.map(shortNumber).join(" × ")]];
  if (field.measured)
    rows.push(["RMS error near", shortNumber(field.measured.nearRms)], ["greatest near", shortNumber(field.measured.nearMax)], ["RMS error", shortNumber(field.measured.rms)], ["greatest error", shortNumber(field.measured.max)]);
  setRows(element("figures", HTMLDListElement), rows);
}

/** @type {WeakMap<Field, FaceMeter>} */
const meters = new WeakMap();

/**
 * Returns rows with the jumps on the face of the cell that is nearest to a point.
 * @param {Field} field
 * @param {Vector} point
 * @returns {[string, string][]}
 */
function jumpRows(field, point) {
  const meter = meters.get(field) ?? new FaceMeter(field);
  meters.set(field, meter);
  const jumps = meter.jumpsNear(point);
  return jumps ? [["jump at nearest face", shortNumber(jumps.value)], ["jump of gradient", shortNumber(jumps.gradient)]] : [];
}

/**
 * Shows what is under the pointer, and what the other field beside it has there.
 * @param {Field} field
 * @param {Pick | null} pick
 * @param {{name: string, field: Field} | null} other
 */
export function showReadout(field, pick, other) {
  const list = element("readout", HTMLDListElement);
  if (!pick) return setRows(list, [["", "nothing"]]);
  const { node, depth } = pick.leaf;
  setRows(list, [
    ["position", pick.point.map(shortNumber).join(", ")],
    ["value", shortNumber(pick.value)],
    ["gradient", pick.gradient.map(shortNumber).join(", ")],
    ["cell", String(node)],
    ["degree", isExact(field, node) ? "exact" : String(degreeOf(field, node))],
    ["depth", String(depth)],
    ...jumpRows(field, pick.point),
    ...(other ? otherRows(pick, other) : []),
  ]);
}

/**
 * @param {Pick} pick
 * @param {{name: string, field: Field}} other
 * @returns {[string, string][]}
 */
function otherRows({ point, value }, { name, field }) {
  const found = query(field, point);
  if (!found) return [[`value in ${name}`, "outside"]];
  return [
    [`value in ${name}`, shortNumber(found.value)],
    ["difference", shortNumber(found.value - value)],
  ];
}

