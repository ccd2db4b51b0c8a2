// The controls above the picture: they show the view and change it.

import { axisAlong } from "../drawing/camera.js";
import { element, setChoices, shortNumber } from "./dom.js";
import { middleOf, movePlaneTo, normalFor, placeOfPlane, placesOfPlane, setPlane } from "../drawing/view.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */
/** @typedef {import("../drawing/view.js").Quantity} Quantity */
/** @typedef {import("../drawing/view.js").View} View */
/** @typedef {import("../drawing/painter.js").Levels} Levels */

/** @type {[Quantity, string][]} */
const COLORS_OF_CELLS = [["value-jump", "jump of the value"], ["gradient-jump", "jump of the gradient"], ["cell-error", "cell error"]];
/** @type {Record<View["kind"], [Quantity, string][]>} */
const COLORS = {
  surface: [["normal", "lit"], ["degree", "degree"], ["depth", "depth"], ...COLORS_OF_CELLS],
  slice: [["degree", "degree"], ["depth", "depth"], ["distance", "distance"], ...COLORS_OF_CELLS],
};

/** Which controls are seen with which view. */
const SEEN = {
  "color-label": () => true,
  "plane-label": (/** @type {View} */ view) => view.kind === "slice" || view.planeInSpace,
  "place-label": (/** @type {View} */ view) => view.kind === "slice" || view.planeInSpace,
  "normal-label": (/** @type {View} */ view) => (view.kind === "slice" || view.planeInSpace) && axisAlong(view.normal) < 0,
  "in-space-label": (/** @type {View} */ view) => view.kind === "surface",
  "offset-label": (/** @type {View} */ view) => view.kind === "surface",
  "cut-label": (/** @type {View} */ view) => view.kind === "surface",
  "cut-place-label": (/** @type {View} */ view) => view.kind === "surface" && view.clip !== null,
  "cells-label": (/** @type {View} */ view) => view.kind === "surface",
};

/** The controls of one page. */
export class Controls {
  /**
   * @param {() => {view: View, field: Field, depths: Levels}} shown  what the page shows now
   * @param {() => void} changed  called when a control has changed the view
   */
  constructor(shown, changed) {
    this.shown = shown;
    this.changed = changed;
    this.onSelect("kind", (view, _, value) => (view.kind = /** @type {View["kind"]} */ (value)));
    this.onSelect("color", (view, _, value) => {
      if (view.kind === "slice") view.sliceColor = /** @type {Quantity} */ (value);
      else view.surfaceColor = /** @type {Quantity} */ (value);
    });
    this.onSelect("axis", (view, field, value) => setPlane(view, field, view.point, normalFor(value, view)));
    this.onSelect("cut", (view, field, value) => {
      const axis = "xyz".indexOf(value);
      view.clip = axis < 0 ? null : { axis, at: middleOf(field)[axis] };
    });
    this.onSelect("cells", (view, _, value) => (view.cells = value));
    this.onInput("offset", (view, _, value) => (view.offset = value));
    this.onInput("place", (view, field, value) => movePlaneTo(view, field, value));
    this.onInput("cut-place", (view, _, value) => view.clip && (view.clip.at = value));
    element("in-space", HTMLInputElement).addEventListener("change", (event) => {
      this.shown().view.planeInSpace = /** @type {HTMLInputElement} */ (event.target).checked;
      this.changed();
    });
    element("normal", HTMLInputElement).addEventListener("change", (event) => {
      const { view, field } = this.shown();
      const normal = /** @type {HTMLInputElement} */ (event.target).value.split(/[,\s]+/).map(Number);
      if (normal.length === 3 && normal.every(Number.isFinite) && Math.hypot(...normal) > 0) setPlane(view, field, view.point, /** @type {Vector} */ (normal));
      this.changed();
    });
  }

  /**
   * @param {string} id
   * @param {(view: View, field: Field, value: string) => void} set
   */
  onSelect(id, set) {
    element(id, HTMLSelectElement).addEventListener("change", (event) => {
      const { view, field } = this.shown();
      set(view, field, /** @type {HTMLSelectElement} */ (event.target).value);
      this.changed();
    });
  }

  /**
   * @param {string} id
   * @param {(view: View, field: Field, value: number) => void} set
   */
  onInput(id, set) {
    element(id, HTMLInputElement).addEventListener("input", (event) => {
      const { view, field } = this.shown();
      set(view, field, Number(/** @type {HTMLInputElement} */ (event.target).value));
      this.changed();
    });
  }

  /** Shows the view in the controls. */
  show() {
    const { view, field, depths } = this.shown();
    for (const [id, isSeen] of Object.entries(SEEN)) element(id, HTMLElement).hidden = !isSeen(view);
    setChoices(element("kind", HTMLSelectElement), [["surface", "surface"], ["slice", "slice"]], view.kind);
    setChoices(element("color", HTMLSelectElement), COLORS[view.kind], view.kind === "slice" ? view.sliceColor : view.surfaceColor);
    const axis = axisAlong(view.normal);
    setChoices(element("axis", HTMLSelectElement), [["x", "x"], ["y", "y"], ["z", "z"], ["oblique", "oblique"]], axis < 0 ? "oblique" : "xyz"[axis]);
    setChoices(element("cut", HTMLSelectElement), [["none", "none"], ["x", "x"], ["y", "y"], ["z", "z"]], view.clip ? "xyz"[view.clip.axis] : "none");
    /** @type {[string, string][]} */
    const levels = depths.map(({ level }) => [String(level), `depth ${level}`]);
    if (![...levels.map(([level]) => level), "none", "all"].includes(view.cells)) levels.push([view.cells, `depths ${view.cells}`]);
    setChoices(element("cells", HTMLSelectElement), [["none", "none"], ["all", "all"], ...levels], view.cells);
    element("in-space", HTMLInputElement).checked = view.planeInSpace;
    element("normal", HTMLInputElement).value = view.normal.map(shortNumber).join(", ").replaceAll("−", "-");
    const reach = 0.25 * Math.min(...field.size);
    this.showSlider("offset", [-reach, reach], view.offset);
    this.showSlider("place", placesOfPlane(view, field), placeOfPlane(view, field));
    if (view.clip) this.showSlider("cut-place", [field.lower[view.clip.axis], field.upper[view.clip.axis]], view.clip.at);
  }

  /**
   * @param {string} id
   * @param {[number, number]} range
   * @param {number} value
   */
  showSlider(id, [least, greatest], value) {
    const slider = element(id, HTMLInputElement);
    slider.min = String(least);
    slider.max = String(greatest);
    slider.value = String(value);
    element(`${id}-value`, HTMLOutputElement).textContent = shortNumber(value);
  }
}
