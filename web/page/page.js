// The page: reads the field that stands in it, draws it, and lets the reader turn, slice and ask.

import { cssColor, divergingColor } from "./colors.js";
import { degreeOf, isExact, isLeaf, readField } from "./field_file.js";
import { Painter } from "./painter.js";
import { add, length, scaled } from "./vector.js";
import { axesOfSlice, firstView, planeOf, scriptOf } from "./view.js";
import { diagonalOf, raysOf } from "./camera.js";
import { query } from "./query.js";

/** @typedef {import("./field_file.js").Field} Field */
/** @typedef {import("./field_file.js").Vector} Vector */
/** @typedef {import("./view.js").View} View */

const COLORS = { surface: ["normal", "degree", "depth"], slice: ["degree", "depth", "distance"] };
const FRAME_TIME = 70; // milliseconds that a frame may take while the view changes
const REST = 150; // milliseconds without a change until the sharp picture is drawn
const NO_CELL = 0xffffffff;

/**
 * @template {HTMLElement} T
 * @param {string} id
 * @param {{new (): T}} type
 * @returns {T}
 */
function element(id, type) {
  const found = document.getElementById(id);
  if (!(found instanceof type)) throw new Error(`the page lacks #${id}`);
  return found;
}

/**
 * Returns the bytes of a zlib stream that is written in base64.
 * @param {string} text
 */
async function inflated(text) {
  const bytes = Uint8Array.from(atob(text.trim()), (character) => character.charCodeAt(0));
  // @ts-ignore: TypeScript 4.8 does not know DecompressionStream, which browsers have had since 2023
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * @param {number} x
 */
function shortNumber(x) {
  return Math.abs(x) < 1e-12 ? "0" : Number(x.toPrecision(5)).toString().replace("-", "−");
}

/**
 * @param {HTMLElement} list
 * @param {[string, string][]} rows
 */
function setRows(list, rows) {
  list.replaceChildren(
    ...rows.flatMap(([name, value]) => {
      const term = document.createElement("dt");
      const description = document.createElement("dd");
      term.textContent = name;
      description.textContent = value;
      return [term, description];
    }),
  );
}

class Page {
  /**
   * @param {Field} field
   * @param {Record<string, string>} sources
   */
  constructor(field, sources) {
    this.field = field;
    this.canvas = element("canvas", HTMLCanvasElement);
    this.painter = new Painter(this.canvas, field, sources, sources["picture.frag"]);
    this.view = firstView(field);
    this.scale = 0.35; // pixels of the buffers for each of the canvas while the view changes
    this.sharpAt = 0;
    this.isPlanned = false;
    /** @type {import("./renderer.js").Target | null} */
    this.hits = null;
    this.listen();
    this.show();
    new ResizeObserver(() => this.resize()).observe(element("stage", HTMLDivElement));
  }

  resize() {
    const stage = element("stage", HTMLDivElement);
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.canvas.width = Math.max(Math.round(stage.clientWidth * ratio), 1);
    this.canvas.height = Math.max(Math.round(stage.clientHeight * ratio), 1);
    this.changed();
  }

  /** Plans a coarse picture for the next frame, and a sharp one for when the view rests. */
  changed() {
    this.sharpAt = performance.now() + REST;
    if (this.isPlanned) return;
    this.isPlanned = true;
    requestAnimationFrame(() => this.frame());
  }

  frame() {
    this.isPlanned = false;
    const begin = performance.now();
    this.hits = this.painter.draw(this.view, this.scale);
    this.painter.gl.finish();
    const taken = performance.now() - begin;
    this.scale = Math.min(Math.max(this.scale * Math.sqrt(FRAME_TIME / Math.max(taken, 1)), 0.1), 1);
    window.setTimeout(() => this.sharpen(), REST);
  }

  sharpen() {
    if (this.isPlanned || performance.now() < this.sharpAt - 1) return;
    this.hits = this.painter.draw(this.view, 1);
    document.body.dataset.state = "sharp";
  }

  /** Shows the state of the view in the controls. */
  show() {
    const { view, field } = this;
    element("kind", HTMLSelectElement).value = view.kind;
    const colors = element("color", HTMLSelectElement);
    colors.replaceChildren(...COLORS[view.kind].map((name) => new Option(name, name)));
    colors.value = view.kind === "slice" ? view.sliceColor : view.surfaceColor;
    element("axis-of-slice", HTMLLabelElement).hidden = view.kind !== "slice";
    element("axis", HTMLSelectElement).value = String(view.axis);
    const offset = element("offset", HTMLInputElement);
    const isSlice = view.kind === "slice";
    const reach = 0.25 * Math.min(...field.size);
    offset.min = String(isSlice ? field.lower[view.axis] : -reach);
    offset.max = String(isSlice ? field.upper[view.axis] : reach);
    offset.value = String(isSlice ? view.at : view.offset);
    element("offset-name", HTMLSpanElement).textContent = isSlice ? "at" : "offset";
    element("offset-value", HTMLOutputElement).textContent = shortNumber(isSlice ? view.at : view.offset);
    this.showLegend();
    this.showFigures();
    document.body.dataset.state = "changing";
    this.changed();
  }

  showLegend() {
    const { view, painter } = this;
    const quantity = view.kind === "slice" ? view.sliceColor : view.surfaceColor;
    const legend = element("legend", HTMLDivElement);
    const titles = { normal: "surface", degree: "polynomial degree", depth: "octree depth", distance: "distance" };
    element("legend-title", HTMLHeadingElement).textContent = titles[quantity];
    if (quantity === "normal") return legend.replaceChildren();
    if (quantity === "distance") {
      const bar = document.createElement("div");
      bar.className = "bar";
      const stops = Array.from({ length: 17 }, (_, i) => cssColor(divergingColor(i / 8 - 1)));
      bar.style.background = `linear-gradient(to right, ${stops.join(", ")})`;
      const ends = document.createElement("div");
      ends.className = "ends";
      for (const x of [-painter.range, 0, painter.range]) {
        const end = document.createElement("span");
        end.textContent = shortNumber(x);
        ends.append(end);
      }
      return legend.replaceChildren(bar, ends);
    }
    const levels = quantity === "degree" ? painter.degrees : painter.depths;
    const most = Math.max(...levels.map(({ share }) => share));
    legend.replaceChildren(
      ...[...levels].reverse().map(({ level, share, color }) => {
        const row = document.createElement("div");
        row.className = "level";
        const name = document.createElement("b");
        name.textContent = level === 31 ? "exact" : String(level);
        name.style.background = cssColor(color);
        name.style.color = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2] > 0.25 ? "#000" : "#fff";
        const percent = document.createElement("span");
        percent.textContent = `${(100 * share).toFixed(1)} %`;
        const bar = document.createElement("i");
        bar.style.width = `${(100 * share) / most}%`;
        row.append(name, percent, bar);
        return row;
      }),
    );
  }

  showFigures() {
    const { field } = this;
    let leaves = 0;
    for (let n = 0; n < field.low.length; ++n) leaves += isLeaf(field, n) ? 1 : 0;
    /** @type {[string, string][]} */
    const rows = [["made from", field.name || "a function"], ["cells", leaves.toLocaleString("en")], ["file", `${(field.bytes / 1e6).toFixed(2)} MB`]];
    if (field.measured) rows.push(["RMS error near", shortNumber(field.measured.nearRms)], ["greatest near", shortNumber(field.measured.nearMax)], ["RMS error", shortNumber(field.measured.rms)]);
    setRows(element("figures", HTMLDListElement), rows);
  }

  /**
   * Returns the point that a pixel of the canvas shows, or null.
   * @param {number} x
   * @param {number} y
   * @returns {Vector | null}
   */
  pointAt(x, y) {
    const { view, field, canvas } = this;
    const u = (2 * x) / canvas.width - 1;
    const v = 1 - (2 * y) / canvas.height;
    if (view.kind === "slice") {
      const plane = planeOf(view, field, canvas.width, canvas.height);
      return add(plane.origin, add(scaled(plane.right, u), scaled(plane.up, v)));
    }
    if (!this.hits) return null;
    const texel = this.hits.at(Math.floor((x / canvas.width) * this.hits.width), Math.floor((y / canvas.height) * this.hits.height));
    if (texel.cell === NO_CELL) return null;
    const rays = raysOf(view.orbit, field, canvas.width / canvas.height);
    const across = add(scaled(rays.right, u), scaled(rays.up, v));
    const direction = rays.parallel ? rays.forward : add(rays.forward, across);
    const start = rays.parallel ? add(rays.eye, across) : rays.eye;
    return add(start, scaled(direction, texel.distance / length(direction)));
  }

  /**
   * Shows what is at a pixel of the canvas.
   * @param {number} x
   * @param {number} y
   */
  readOut(x, y) {
    const { field } = this;
    const point = this.pointAt(x, y);
    const found = point && query(field, point);
    const list = element("readout", HTMLDListElement);
    if (!point || !found) return setRows(list, [["", "nothing"]]);
    const { node, depth } = found.leaf;
    setRows(list, [
      ["position", point.map(shortNumber).join(", ")],
      ["value", shortNumber(found.value)],
      ["gradient", found.gradient.map(shortNumber).join(", ")],
      ["cell", String(node)],
      ["degree", isExact(field, node) ? "exact" : String(degreeOf(field, node))],
      ["depth", String(depth)],
    ]);
  }

  listen() {
    const { canvas } = this;
    const select = (/** @type {string} */ id, /** @type {(value: string) => void} */ set) =>
      element(id, HTMLSelectElement).addEventListener("change", (event) => {
        set(/** @type {HTMLSelectElement} */ (event.target).value);
        this.show();
      });
    select("kind", (value) => (this.view.kind = /** @type {View["kind"]} */ (value)));
    select("axis", (value) => {
      this.view.axis = /** @type {0 | 1 | 2} */ (Number(value));
      this.view.at = this.view.middle[this.view.axis];
    });
    select("color", (value) => {
      const quantity = /** @type {import("./view.js").Quantity} */ (value);
      if (this.view.kind === "slice") this.view.sliceColor = quantity;
      else this.view.surfaceColor = quantity;
    });
    element("offset", HTMLInputElement).addEventListener("input", (event) => {
      const value = Number(/** @type {HTMLInputElement} */ (event.target).value);
      if (this.view.kind === "slice") this.view.at = value;
      else this.view.offset = value;
      element("offset-value", HTMLOutputElement).textContent = shortNumber(value);
      this.changed();
    });
    element("copy", HTMLButtonElement).addEventListener("click", () => this.copyView());
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(event.deltaY * 0.001));
    });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /**
   * @param {PointerEvent} event
   */
  move(event) {
    const { view, canvas } = this;
    const box = canvas.getBoundingClientRect();
    const ratio = canvas.width / box.width;
    if (event.buttons === 0) return this.readOut((event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio);
    if (view.kind === "slice" || event.buttons === 2 || event.shiftKey) this.pan(event.movementX / box.width, event.movementY / box.height);
    else this.turn(-0.4 * event.movementX, 0.4 * event.movementY);
  }

  /**
   * @param {number} azimuth
   * @param {number} elevation
   */
  turn(azimuth, elevation) {
    const { orbit } = this.view;
    orbit.azimuth += azimuth;
    orbit.elevation = Math.min(Math.max(orbit.elevation + elevation, -90), 90);
    this.changed();
  }

  /**
   * Moves the picture by shares of its width and height.
   * @param {number} x
   * @param {number} y
   */
  pan(x, y) {
    const { view, field, canvas } = this;
    if (view.kind === "slice") {
      const [across, upward] = axesOfSlice(view.axis);
      const plane = planeOf(view, field, canvas.width, canvas.height);
      view.middle[across] -= 2 * x * plane.right[across];
      view.middle[upward] += 2 * y * plane.up[upward];
    } else {
      const rays = raysOf(view.orbit, field, canvas.width / canvas.height);
      const reach = rays.parallel ? 1 : view.orbit.distance * diagonalOf(field);
      view.orbit.target = add(view.orbit.target, add(scaled(rays.right, -2 * x * reach), scaled(rays.up, 2 * y * reach)));
    }
    this.changed();
  }

  /**
   * @param {number} factor  above 1 farther away
   */
  zoom(factor) {
    const { view } = this;
    if (view.kind === "slice") view.zoom = Math.min(Math.max(view.zoom / factor, 0.5), 1e4);
    else view.orbit.distance = Math.min(Math.max(view.orbit.distance * factor, 0.01), 20);
    this.changed();
  }

  /**
   * @param {KeyboardEvent} event
   */
  key(event) {
    const step = 5;
    const isSlice = this.view.kind === "slice";
    /** @type {Record<string, () => void>} */
    const actions = {
      ArrowLeft: () => (isSlice ? this.pan(0.05, 0) : this.turn(step, 0)),
      ArrowRight: () => (isSlice ? this.pan(-0.05, 0) : this.turn(-step, 0)),
      ArrowUp: () => (isSlice ? this.pan(0, 0.05) : this.turn(0, step)),
      ArrowDown: () => (isSlice ? this.pan(0, -0.05) : this.turn(0, -step)),
      "+": () => this.zoom(0.8),
      "-": () => this.zoom(1.25),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  copyView() {
    const lines = scriptOf(this.view, this.field);
    const tell = () => (element("message", HTMLParagraphElement).textContent = lines);
    navigator.clipboard?.writeText(lines).then(tell, tell) ?? tell();
  }
}

async function start() {
  const message = element("message", HTMLParagraphElement);
  try {
    const sources = Object.fromEntries([...document.querySelectorAll("script[data-name]")].map((script) => [script.getAttribute("data-name"), script.textContent]));
    const field = readField(await inflated(element("field", HTMLScriptElement).textContent ?? ""));
    const page = new Page(field, sources);
    // Tests and curious readers find the page here, with functions to ask it.
    Object.assign(window, { hpsdf: { page, field, query, firstView, planeOf, raysOf, scriptOf, degreeOf, add, scaled } });
  } catch (error) {
    message.textContent = `The field cannot be shown: ${error instanceof Error ? error.message : error}`;
    document.body.dataset.state = "failed";
  }
}

start();
