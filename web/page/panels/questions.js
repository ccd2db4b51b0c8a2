// The panels that answer questions about a field: the worst interfaces between cells, the field along a line, lengths.

import { axisVector, diagonalOf } from "../drawing/camera.js";
import { element, setRows, shortNumber } from "./dom.js";
import { cellErrors, decadesOf } from "../questions/cell_numbers.js";
import { Jumps } from "../questions/jumps.js";
import { linePlot } from "../questions/line_plot.js";
import { sampleLine, scriptOfProbe } from "../questions/line_probe.js";
import { distanceBetween, thicknessAt } from "../questions/measure.js";
import { query } from "../field/query.js";
import { length, normalized } from "../field/vector.js";
import { setPlane } from "../drawing/view.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */
/** @typedef {import("../questions/jumps.js").Interface} Interface */
/** @typedef {import("../questions/jumps.js").JumpKind} JumpKind */
/** @typedef {import("../drawing/pick.js").Pick} Pick */
/** @typedef {import("../drawing/view.js").View} View */
/** @typedef {import("../drawing/viewer.js").Viewer} Viewer */

/**
 * The page, as its panels know it.
 * @typedef {object} Host
 * @property {Viewer} viewer  that of the chosen field
 * @property {Viewer[]} viewers  all that are shown
 * @property {View} view
 * @property {((pick: Pick) => void) | null} onPick  what a click into the picture does
 * @property {() => void} changed  shows a changed view
 * @property {() => void} placeMark
 * @property {(text: string) => void} say
 */

const PORTION = 10; // milliseconds that measuring jumps may take at a time
const ROWS = 8; // interfaces on a page of the list
const LINE_SAMPLES = 300;
/** @type {JumpKind[]} */
const JUMP_KINDS = ["value", "gradient"];

/** The list of the interfaces at which a field jumps most, and the jumps for the colours of cells. */
class WorstPanel {
  /**
   * @param {Host} host
   */
  constructor(host) {
    this.host = host;
    /** @type {WeakMap<Viewer, Jumps>} */
    this.measured = new WeakMap();
    this.first = 0; // rank of the first interface in the list, from 0
    for (const id of ["worst-by", "worst-on"])
      element(id, HTMLSelectElement).addEventListener("change", () => {
        this.first = 0;
        this.show();
      });
    this.onClick("worst-previous", () => (this.first -= ROWS));
    this.onClick("worst-next", () => (this.first += ROWS));
    element("worst", HTMLDetailsElement).addEventListener("toggle", () => this.show());
  }

  /**
   * @param {string} id
   * @param {() => void} action
   */
  onClick(id, action) {
    element(id, HTMLButtonElement).addEventListener("click", () => {
      action();
      this.show();
    });
  }

  /** Measures jumps and errors where the colours of the view need them. */
  measureForColors() {
    const { view, viewers } = this.host;
    const quantity = view.kind === "slice" ? view.sliceColor : view.surfaceColor;
    if (quantity === "value-jump" || quantity === "gradient-jump") viewers.forEach((viewer) => this.measure(viewer));
    if (quantity !== "cell-error") return;
    for (const { field, painter } of viewers) {
      if (painter.cellNumbers.has(quantity)) continue;
      const errors = cellErrors(field);
      painter.setCellNumbers(quantity, errors, decadesOf(field, errors));
    }
  }

  /**
   * Measures the jumps of a field, in portions between which the page goes on.
   * @param {Viewer} viewer
   */
  measure(viewer) {
    if (this.measured.has(viewer)) return;
    const jumps = new Jumps(viewer.field);
    this.measured.set(viewer, jumps);
    const portion = () => {
      if (viewer.isRemoved) return;
      if (!jumps.run(PORTION)) setTimeout(portion);
      else {
        for (const kind of JUMP_KINDS) viewer.painter.setCellNumbers(`${kind}-jump`, jumps.ofCells[kind], decadesOf(viewer.field, jumps.ofCells[kind]));
        this.host.changed();
      }
      if (viewer === this.host.viewer) this.show();
    };
    portion();
  }

  /** Shows the list, or how much of the jumps has been measured. */
  show() {
    if (!element("worst", HTMLDetailsElement).open) return;
    const jumps = this.measured.get(this.host.viewer);
    if (!jumps) return this.measure(this.host.viewer);
    const progress = element("worst-share", HTMLProgressElement);
    const list = element("worst-list", HTMLOListElement);
    progress.value = jumps.share;
    progress.hidden = jumps.share === 1;
    if (jumps.share < 1) return list.replaceChildren();
    const kind = /** @type {JumpKind} */ (element("worst-by", HTMLSelectElement).value);
    const atSurface = element("worst-on", HTMLSelectElement).value === "surface";
    const last = this.first + ROWS;
    const worst = jumps.worst(kind, atSurface, last + 1); // one more tells whether there is a next page
    list.start = this.first + 1;
    const faces = worst.map((n) => jumps.at(n)).filter((face) => face[kind] > 0);
    list.replaceChildren(...(faces.length > 0 ? faces.slice(this.first, last).map((face) => this.row(face, kind)) : ["no jumps"]));
    element("worst-previous", HTMLButtonElement).disabled = this.first === 0;
    element("worst-next", HTMLButtonElement).disabled = faces.length <= last;
  }

  /**
   * @param {Interface} face
   * @param {JumpKind} kind
   */
  row(face, kind) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = `${shortNumber(face[kind])}${face.isTorn ? ", torn" : ""}`;
    const place = document.createElement("small");
    place.textContent = face.worst.map((x) => shortNumber(Math.fround(x))).join(", ");
    button.append(place);
    button.addEventListener("click", () => {
      flyTo(this.host.view, this.host.viewer.field, face);
      this.host.changed();
    });
    const item = document.createElement("li");
    item.append(button);
    return item;
  }
}

/**
 * Changes a view so that it shows an interface from near: the camera looks at it from outside if it lies at the surface. Else the view
 * becomes a slice across the interface.
 * @param {View} view
 * @param {Field} field
 * @param {Interface} face
 */
export function flyTo(view, field, { worst, axis, depth, isAtSurface }) {
  const edge = field.size[0] / field.grid[0] / 2 ** depth;
  view.mark = worst;
  if (view.kind === "surface" && isAtSurface) {
    view.orbit.target = worst;
    view.orbit.distance = (10 * edge) / diagonalOf(field);
    view.clip = null;
    lookFromOutside(view, normalized(query(field, worst)?.gradient ?? [0, 0, 0]));
    return;
  }
  view.kind = "slice";
  if (view.sliceColor === "distance") view.sliceColor = "value-jump"; // whose colours have outlines of the cells
  setPlane(view, field, worst, axisVector(axis === 2 ? 1 : 2));
  view.zoom = Math.max(1, Math.max(...field.size) / (6 * edge));
  view.target = worst;
}

/**
 * @param {View} view
 * @param {Vector} outward  of length 1 or 0
 */
function lookFromOutside({ orbit }, outward) {
  if (!(length(outward) > 0)) return;
  const [height, front] = orbit.upZ ? [outward[2], -outward[1]] : [outward[1], outward[2]];
  orbit.elevation = (Math.asin(Math.min(Math.max(height, -1), 1)) * 180) / Math.PI;
  orbit.azimuth = (Math.atan2(outward[0], front) * 180) / Math.PI;
}

/**
 * Lets clicks into the picture choose points: `done` is called once there are as many as asked for.
 * @param {Host} host
 * @param {number} count
 * @param {(picks: Pick[]) => void} done
 */
function pickPoints(host, count, done) {
  /** @type {Pick[]} */
  const picks = [];
  const ask = () => host.say(count === 1 ? "Click a point of the surface." : `Click the ${picks.length === 0 ? "first" : "second"} point.`);
  host.onPick = (pick) => {
    picks.push(pick);
    host.view.mark = pick.point;
    host.placeMark();
    if (picks.length < count) return ask();
    host.onPick = null;
    host.say("");
    done(picks);
  };
  ask();
}

/** The field along a line between two points. */
class ProbePanel {
  /**
   * @param {Host} host
   */
  constructor(host) {
    this.host = host;
    for (const id of ["probe-from", "probe-to"]) element(id, HTMLInputElement).addEventListener("change", () => this.show());
    element("probe-pick", HTMLButtonElement).addEventListener("click", () =>
      pickPoints(host, 2, ([from, to]) => {
        element("probe-from", HTMLInputElement).value = from.point.join(",");
        element("probe-to", HTMLInputElement).value = to.point.join(",");
        this.show();
      }),
    );
    element("probe", HTMLDetailsElement).addEventListener("toggle", () => this.show());
  }

  /**
   * @param {string} id
   * @returns {Vector | null}
   */
  pointIn(id) {
    const words = element(id, HTMLInputElement).value.split(",");
    const numbers = words.map((word) => (word.trim() === "" ? NaN : Number(word)));
    return numbers.length === 3 && numbers.every(Number.isFinite) ? /** @type {Vector} */ (numbers) : null;
  }

  show() {
    const { host } = this;
    const from = this.pointIn("probe-from"), to = this.pointIn("probe-to");
    const plot = element("probe-plot", HTMLDivElement);
    const script = element("probe-script", HTMLElement);
    if (!element("probe", HTMLDetailsElement).open) return;
    plot.replaceChildren();
    script.textContent = "";
    if (!from || !to || length(distanceBetween(from, to).components) === 0) {
      if (["probe-from", "probe-to"].every((id) => element(id, HTMLInputElement).value !== "")) plot.replaceChildren("The ends are three numbers with commas each, and differ.");
      return;
    }
    script.textContent = scriptOfProbe(from, to);
    const { field, painter } = host.viewer;
    const line = sampleLine(field, from, to, LINE_SAMPLES);
    const width = Math.max(plot.clientWidth, 300);
    plot.append(
      linePlot(field, line, painter, width, (point) => {
        host.view.mark = point;
        host.placeMark();
      }),
    );
  }
}

/** Lengths between and at points that are picked. */
class MeasurePanel {
  /**
   * @param {Host} host
   */
  constructor(host) {
    this.host = host;
    element("measure-distance", HTMLButtonElement).addEventListener("click", () => pickPoints(host, 2, ([from, to]) => this.showDistance(from, to)));
    element("measure-thickness", HTMLButtonElement).addEventListener("click", () => {
      if (host.view.kind === "surface") pickPoints(host, 1, ([pick]) => this.showThickness(pick));
      else host.say("Show the surface first; the thickness is measured from one of its points.");
    });
  }

  /**
   * @param {Pick} from
   * @param {Pick} to
   */
  showDistance(from, to) {
    const { distance, components } = distanceBetween(from.point, to.point);
    setRows(element("lengths", HTMLDListElement), [["distance", shortNumber(distance)], ["along x, y, z", components.map(shortNumber).join(", ")]]);
  }

  /**
   * @param {Pick} pick
   */
  showThickness(pick) {
    const { viewer, view } = this.host;
    const thickness = pick.onSurface ? thicknessAt(viewer.field, viewer.painter.renderer.bounds, pick.point, view.offset) : null;
    const text = thickness !== null ? shortNumber(thickness) : pick.onSurface ? "none: the body reaches the end of the domain" : "none: this point is not on the surface";
    setRows(element("lengths", HTMLDListElement), [["thickness", text], ["at", pick.point.map(shortNumber).join(", ")]]);
  }
}

/** All panels that answer questions. */
export class Questions {
  /**
   * @param {Host} host
   */
  constructor(host) {
    this.worst = new WorstPanel(host);
    this.probe = new ProbePanel(host);
    this.measure = new MeasurePanel(host);
  }

  /** Answers for another field. */
  fieldChanged() {
    this.worst.first = 0;
    this.worst.show();
    this.probe.show();
    setRows(element("lengths", HTMLDListElement), []);
  }

  /** Answers for a changed view. */
  viewChanged() {
    this.worst.measureForColors();
  }
}
