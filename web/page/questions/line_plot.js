// The plot of a field along a line: the value, the gradient's length and its component along the line, the degrees and depths of the cells.

import { cssColor, letterColor } from "../drawing/colors.js";
import { shortNumber } from "../panels/dom.js";
import { EXACT_DEGREE, degreeOf } from "../field/field_file.js";
import { length } from "../field/vector.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */
/** @typedef {import("./line_probe.js").Line} Line */
/** @typedef {import("./line_probe.js").LineSample} LineSample */
/** @typedef {import("../drawing/painter.js").Levels} Levels */

/** @typedef {{name: string, valueOf: (sample: LineSample) => number}} Curve  whose name is its class in the styles */
/** @typedef {{low: number, high: number, top: number, height: number}} Scale  a range of values and where it is drawn */

const SVG = "http://www.w3.org/2000/svg";
// Lengths in pixels.
const LEFT = 48; // of the charts, with the numbers of their axes
const RIGHT = 10;
const TITLE = 17;
const VALUE_HEIGHT = 110;
const GRADIENT_HEIGHT = 80;
const BAND = 15;
const GAP = 6;
const FOOT = 34;
const TEXT = 11;

/**
 * Returns an element of a drawing.
 * @param {string} name
 * @param {Record<string, string | number>} attributes
 * @param {string} [text]
 */
function shape(name, attributes, text = "") {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  made.textContent = text;
  return made;
}

/**
 * Returns the least of 1, 2 and 5 times powers of ten that divides a range into at most so many steps.
 * @param {number} range
 * @param {number} count
 */
function niceStep(range, count) {
  const power = 10 ** Math.floor(Math.log10(range / count));
  return power * ([1, 2, 5].find((factor) => factor * power * count >= range * (1 - 1e-9)) ?? 10);
}

/**
 * Returns the multiples of a step within a range.
 * @param {number} low
 * @param {number} high
 * @param {number} step
 */
function ticksIn(low, high, step) {
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, n) => (first + n) * step);
}

/**
 * Returns the number at a tick, with as many digits as tell it from its neighbours.
 * @param {number} value
 * @param {number} step
 */
function tickText(value, step) {
  if (Math.abs(value) < 1e-9 * step) return "0";
  const order = (/** @type {number} */ x) => Math.floor(Math.log10(Math.abs(x)) + 1e-9);
  const digits = Math.min(Math.max(order(value) - order(step) + 1, 1), 15);
  return Number(value.toPrecision(digits)).toString().replace("-", "−");
}

/**
 * Returns the scale of curves: their range with a margin. A curve that is constant up to rounding gets a wide one.
 * @param {Line} line
 * @param {Curve[]} curves
 * @param {number} top
 * @param {number} height
 * @returns {Scale}
 */
function scaleOf(line, curves, top, height) {
  let low = Infinity, high = -Infinity;
  for (const sample of line.samples)
    for (const { valueOf } of curves) {
      low = Math.min(low, valueOf(sample));
      high = Math.max(high, valueOf(sample));
    }
  const size = Math.max(Math.abs(low), Math.abs(high));
  const margin = high - low > 1e-6 * size ? 0.06 * (high - low) : size > 0 ? 0.05 * size : 1;
  return { low: low - margin, high: high + margin, top, height };
}

/** Draws one line. */
class LinePlotter {
  /**
   * @param {Field} field
   * @param {Line} line
   * @param {{degrees: Levels, depths: Levels}} levels  those of the whole field, with their colours
   * @param {number} width
   */
  constructor(field, line, levels, width) {
    this.field = field;
    this.line = line;
    this.levels = levels;
    this.width = width;
    this.bands = 2 * TITLE + VALUE_HEIGHT + GRADIENT_HEIGHT + GAP; // where the bands begin
    this.bottom = this.bands + 2 * BAND + GAP / 2;
    const height = this.bottom + FOOT;
    this.svg = shape("svg", { width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": "the field along the line" });
  }

  /**
   * @param {number} t
   */
  x(t) {
    return LEFT + t * (this.width - LEFT - RIGHT);
  }

  draw() {
    /** @type {Curve[]} */
    const values = [{ name: "value", valueOf: (sample) => sample.value }];
    /** @type {Curve[]} */
    const gradients = [{ name: "length", valueOf: (sample) => length(sample.gradient) }, { name: "slope", valueOf: (sample) => sample.slope }];
    this.shadeOutside();
    this.drawBand("degree", this.bands, this.levels.degrees, (leaf) => degreeOf(this.field, leaf.node));
    this.drawBand("depth", this.bands + BAND + GAP / 2, this.levels.depths, (leaf) => leaf.depth);
    this.drawBorders();
    this.drawTitle(TITLE, [["value", "value, in the field’s units"]]);
    this.drawChart(values, TITLE, VALUE_HEIGHT);
    const second = TITLE + VALUE_HEIGHT;
    this.drawTitle(second + TITLE, [["length", "length of the gradient"], ["slope", "along the line"]]);
    this.drawChart(gradients, second + TITLE, GRADIENT_HEIGHT);
    this.drawAbscissa();
    return this.svg;
  }

  shadeOutside() {
    for (const { leaf, enter, leave } of this.line.pieces)
      if (!leaf) this.svg.append(shape("rect", { class: "outside", x: this.x(enter), y: TITLE, width: this.x(leave) - this.x(enter), height: this.bottom - TITLE }));
  }

  /** Draws thin lines at borders of cells, the thinner the denser they are. They leave the title of the second chart free. */
  drawBorders() {
    const { pieces } = this.line;
    const second = TITLE + VALUE_HEIGHT;
    for (let n = 1; n < pieces.length; ++n) {
      const x = this.x(pieces[n].enter);
      const room = this.x(pieces[n].leave) - this.x(pieces[n - 1].enter);
      const width = Math.min(Math.max(0.04 * room, 0.2), 1);
      this.svg.append(shape("path", { class: "border", d: `M${x} ${TITLE}V${second}M${x} ${second + TITLE}V${this.bottom}`, "stroke-width": width }));
    }
  }

  /**
   * @param {number} y  the upper end of the chart
   * @param {[string, string][]} names  classes and texts
   */
  drawTitle(y, names) {
    let x = LEFT;
    for (const [name, text] of names) {
      this.svg.append(shape("line", { class: name, x1: x, x2: x + 14, y1: y - 8, y2: y - 8 }), shape("text", { x: x + 18, y: y - 4 }, text));
      x += 28 + 0.5 * TEXT * text.length;
    }
  }

  /**
   * @param {Curve[]} curves
   * @param {number} top
   * @param {number} height
   */
  drawChart(curves, top, height) {
    const scale = scaleOf(this.line, curves, top, height);
    const yOf = (/** @type {number} */ value) => top + ((scale.high - value) / (scale.high - scale.low)) * height;
    const step = niceStep(scale.high - scale.low, height / (2.4 * TEXT));
    for (const tick of ticksIn(scale.low, scale.high, step)) {
      const y = yOf(tick);
      const text = tickText(tick, step);
      this.svg.append(shape("line", { class: text === "0" ? "zero" : "grid", x1: LEFT, x2: this.width - RIGHT, y1: y, y2: y }));
      this.svg.append(shape("text", { x: LEFT - 5, y: y + 4, "text-anchor": "end" }, text));
    }
    for (const { name, valueOf } of curves) {
      const points = this.line.samples.map((sample) => `${this.x(sample.t).toFixed(2)} ${yOf(valueOf(sample)).toFixed(2)}`);
      this.svg.append(shape("path", { class: name, d: `M${points.join("L")}` }));
    }
  }

  /**
   * @param {string} name
   * @param {number} y
   * @param {Levels} levels
   * @param {(leaf: import("../field/leaves.js").OctreeNode) => number} levelOf
   */
  drawBand(name, y, levels, levelOf) {
    this.svg.append(shape("text", { x: LEFT - 5, y: y + 0.5 * BAND + 4, "text-anchor": "end" }, name));
    for (const { leaf, enter, leave } of this.line.pieces) {
      if (!leaf) continue;
      const level = levelOf(leaf);
      const color = levels.find((entry) => entry.level === level)?.color ?? [0, 0, 0];
      const x = this.x(enter), width = this.x(leave) - x;
      const box = shape("rect", { x, y, width, height: BAND });
      box.style.fill = cssColor(color);
      this.svg.append(box);
      const text = name === "degree" && level === EXACT_DEGREE ? "exact" : String(level);
      if (0.6 * TEXT * text.length + 2 > width) continue;
      const label = shape("text", { x: x + width / 2, y: y + 0.5 * BAND + 4, "text-anchor": "middle" }, text);
      label.style.fill = letterColor(color);
      this.svg.append(label);
    }
  }

  drawAbscissa() {
    const whole = this.line.length;
    const step = niceStep(whole, (this.width - LEFT - RIGHT) / (5 * TEXT));
    for (const tick of ticksIn(0, whole, step)) {
      const x = this.x(tick / whole);
      this.svg.append(shape("line", { class: "zero", x1: x, x2: x, y1: this.bottom, y2: this.bottom + 4 }));
      this.svg.append(shape("text", { x, y: this.bottom + 15, "text-anchor": "middle" }, tickText(tick, step)));
    }
    this.svg.append(shape("text", { class: "quiet", x: this.x(0.5), y: this.bottom + 29, "text-anchor": "middle" }, "along the line, in the field’s units"));
  }
}

/**
 * Returns in words what a sample of a line holds.
 * @param {Field} field
 * @param {Line} line
 * @param {LineSample} sample
 */
function textOfSample(field, line, sample) {
  const { leaf } = line.pieces[sample.piece];
  const numbers = `at ${shortNumber(sample.t * line.length)}: value ${shortNumber(sample.value)}, gradient ${shortNumber(length(sample.gradient))}, along the line ${shortNumber(sample.slope)}`;
  if (!leaf) return `${numbers}; outside of the domain`;
  const degree = degreeOf(field, leaf.node);
  return `${numbers}; cell ${leaf.node}, ${degree === EXACT_DEGREE ? "exact" : `degree ${degree}`}, depth ${leaf.depth}`;
}

/**
 * Returns the plot of a line, which tells the values at the place of the pointer.
 * @param {Field} field
 * @param {Line} line
 * @param {{degrees: Levels, depths: Levels}} levels  those of the whole field
 * @param {number} width  in pixels
 * @param {(point: Vector) => void} onPlace  called with the point of the line at which the pointer is
 */
export function linePlot(field, line, levels, width, onPlace) {
  const plotter = new LinePlotter(field, line, levels, width);
  const svg = plotter.draw();
  const cursor = shape("line", { class: "cursor", y1: TITLE, y2: plotter.bottom, visibility: "hidden" });
  svg.append(cursor);
  const told = document.createElement("output");
  told.textContent = "Point at the plot to read its values.";
  svg.addEventListener("pointermove", (event) => {
    const x = event.clientX - svg.getBoundingClientRect().left;
    const away = (/** @type {LineSample} */ sample) => Math.abs(plotter.x(sample.t) - x);
    const nearest = line.samples.reduce((best, sample) => (away(sample) < away(best) ? sample : best));
    for (const end of ["x1", "x2"]) cursor.setAttribute(end, String(plotter.x(nearest.t)));
    cursor.setAttribute("visibility", "visible");
    told.textContent = textOfSample(field, line, nearest);
    onPlace(nearest.point);
  });
  const plot = document.createElement("figure");
  plot.className = "plot";
  plot.append(svg, told);
  return plot;
}
