// The page: reads the fields that stand in it, draws them, and lets the reader turn, slice and ask.

import { axisAlong, diagonalOf, raysOf, screenAxes } from "./drawing/camera.js";
import { Controls } from "./panels/controls.js";
import { element, setChoices } from "./panels/dom.js";
import { degreeOf, readField } from "./field/field_file.js";
import { pickAt } from "./drawing/pick.js";
import { forEachLeaf } from "./field/leaves.js";
import { inflated } from "./field/payload.js";
import { showFigures, showLegend, showReadout } from "./panels/panels.js";
import { Questions } from "./panels/questions.js";
import { query } from "./field/query.js";
import { cellErrors } from "./questions/cell_numbers.js";
import { FaceMeter, Jumps } from "./questions/jumps.js";
import { sampleLine } from "./questions/line_probe.js";
import { distanceBetween, thicknessAt } from "./questions/measure.js";
import { add, dot, scaled, subtract } from "./field/vector.js";
import { DISTANCES, ZOOMS, firstView, fitPlanes, movePlaneTo, placeOfPlane, planeOf, scriptOf, setPlane, viewFrom, within } from "./drawing/view.js";
import { Viewer } from "./drawing/viewer.js";

/** @typedef {import("./field/field_file.js").Field} Field */
/** @typedef {import("./field/field_file.js").Vector} Vector */
/** @typedef {import("./drawing/pick.js").Pick} Pick */
/** @typedef {import("./drawing/view.js").View} View */

const MOST_VIEWERS = 6; // browsers give a page few graphics contexts

/** A field of the page, which is read when it is first shown. */
class Tab {
  /**
   * @param {HTMLScriptElement} script
   */
  constructor(script) {
    this.script = script;
    this.name = script.dataset.name ?? "field";
    /** @type {Promise<void> | null} */
    this.reading = null;
    /** @type {Field | null} */
    this.field = null;
    /** @type {Viewer | null} */
    this.viewer = null;
    this.failure = ""; // why the field cannot be shown
    this.shownAt = 0; // when it was last shown, to know which viewer is needed least
  }

  /** Reads the field. A second call waits for the first. */
  read() {
    this.reading ??= (async () => {
      this.field = readField(await inflated(this.script.textContent ?? ""));
      this.script.textContent = ""; // its memory is needed no more
    })();
    return this.reading;
  }
}

class Page {
  constructor() {
    this.sources = Object.fromEntries([...document.querySelectorAll("script[data-name][type=x-shader]")].map((script) => [script.getAttribute("data-name"), script.textContent]));
    this.tabs = [...document.querySelectorAll("script.field")].map((script) => new Tab(/** @type {HTMLScriptElement} */ (script)));
    /** @type {Tab} */
    this.tab = this.tabs[0];
    /** @type {Tab | null} */
    this.beside = null;
    /** @type {View | null} */
    this.theView = null;
    /** @type {((pick: Pick) => void) | null} */
    this.onPick = null; // what a click into the picture does
    /** @type {Map<number, {x: number, y: number}>} */
    this.pointers = new Map();
    this.moved = 0; // pixels since a pointer was pressed
  }

  /** What is shown; it is there once the first field is read. */
  get view() {
    if (!this.theView) throw new Error("no field has been read");
    return this.theView;
  }

  get viewer() {
    if (!this.tab.viewer) throw new Error("the field has not been read");
    return this.tab.viewer;
  }

  get field() {
    return this.viewer.field;
  }

  /** The viewers on the page: one, or two with linked cameras. */
  get viewers() {
    return this.beside?.viewer ? [this.viewer, this.beside.viewer] : [this.viewer];
  }

  async start() {
    if (this.tabs.length === 0) return this.showFailure("the page holds no field");
    this.listen();
    await this.choose(this.tab, null);
    new ResizeObserver(() => this.shownViewers().forEach((viewer) => viewer.resize())).observe(element("stage", HTMLDivElement));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.tab.viewer && this.arrange());
  }

  /** The viewers on the page, if the chosen field can be shown. */
  shownViewers() {
    return this.tab.viewer ? this.viewers : [];
  }

  /**
   * Shows the tab's field, and the one beside it.
   * @param {Tab} tab
   * @param {Tab | null} beside
   */
  async choose(tab, beside) {
    const choice = (this.choice = {});
    for (const one of beside ? [tab, beside] : [tab]) await this.open(one);
    if (this.choice !== choice) return; // another one was chosen meanwhile
    this.tab = tab;
    this.beside = beside === tab || beside?.failure ? null : beside;
    this.removeOldViewers();
    this.showTabs();
    if (tab.failure) return this.showFailure(tab.failure);
    this.say(beside?.failure ? `${beside.name} cannot be shown: ${beside.failure}` : "");
    this.arrange();
  }

  /**
   * Makes a tab's viewer if it has none, or says in the tab why it has none.
   * @param {Tab} tab
   */
  async open(tab) {
    tab.shownAt = performance.now();
    if (tab.viewer) return;
    try {
      await tab.read();
      if (tab.field) this.makeViewer(tab, tab.field);
      tab.failure = "";
    } catch (error) {
      tab.failure = error instanceof Error ? error.message : String(error);
    }
  }

  /**
   * @param {Tab} tab
   * @param {Field} field
   */
  makeViewer(tab, field) {
    if (tab.viewer) return;
    this.theView ??= firstView(field);
    const canvas = document.createElement("canvas");
    canvas.tabIndex = 0;
    canvas.setAttribute("aria-label", tab.name);
    canvas.hidden = true;
    /** @type {Viewer} */
    const viewer = new Viewer(canvas, field, this.sources, this.view, {
      changed: () => this.shownViewers().includes(viewer) && (document.body.dataset.state = "changing"),
      painted: () => this.shownViewers().includes(viewer) && this.painted(),
      rested: () => this.rested(),
      failed: (error) => this.viewerFailed(tab, error),
    });
    element("stage", HTMLDivElement).prepend(canvas);
    tab.viewer = viewer;
    this.listenTo(viewer);
  }

  /** Removes the viewers that were shown longest ago, but for as many as browsers allow; their fields stay. */
  removeOldViewers() {
    const made = this.tabs.filter((tab) => tab.viewer).sort((a, b) => b.shownAt - a.shownAt);
    for (const tab of made.slice(MOST_VIEWERS)) this.removeViewer(tab);
  }

  /**
   * @param {Tab} tab
   */
  removeViewer(tab) {
    tab.viewer?.remove();
    tab.viewer = null;
  }

  /**
   * @param {Tab} tab
   * @param {unknown} error
   */
  viewerFailed(tab, error) {
    tab.failure = error instanceof Error ? error.message : String(error);
    this.removeViewer(tab);
    if (tab === this.beside) this.choose(this.tab, null);
    if (tab === this.tab) this.showFailure(tab.failure);
  }

  /** Gives the shown viewers their places on the page. */
  arrange() {
    const shown = this.viewers;
    if (!this.controls) {
      this.controls = new Controls(() => ({ view: this.view, field: this.field, depths: this.viewer.painter.depths }), () => this.changed());
      this.questions = new Questions(this);
      const lines = this.tab.script.dataset.view;
      if (lines) this.apply(lines);
    }
    for (const { viewer } of this.tabs) if (viewer) viewer.canvas.hidden = !shown.includes(viewer);
    fitPlanes(this.view, this.field);
    this.setPaper();
    shown.forEach((viewer, place) => {
      viewer.view = this.view;
      viewer.painter.shareScales(shown.map(({ painter }) => painter));
      viewer.canvas.style.left = `${(100 * place) / shown.length}%`;
      viewer.canvas.style.width = `${100 / shown.length}%`;
      viewer.canvas.classList.toggle("second", place === 1);
      viewer.resize();
    });
    showFigures(this.field);
    this.questions?.fieldChanged();
    this.changed();
  }

  /** Shows the state of the view, which something has changed. */
  changed() {
    this.questions?.viewChanged();
    this.controls?.show();
    showLegend(this.view, this.viewer.painter);
    element("script", HTMLTextAreaElement).value = scriptOf(this.view, this.field);
    for (const viewer of this.viewers) viewer.changed();
  }

  painted() {
    element("pictures", HTMLDivElement).hidden = true;
    if (performance.getEntriesByName("first picture").length === 0) performance.mark("first picture");
    this.placeMark();
  }

  rested() {
    const shown = this.shownViewers();
    if (shown.length === 0 || !shown.every((viewer) => viewer.isSharp)) return;
    performance.mark("sharp picture");
    document.body.dataset.state = "sharp";
  }

  /**
   * Shows pictures in place of the field, and the reason.
   * @param {string} reason
   */
  showFailure(reason) {
    document.body.dataset.state = "failed";
    for (const { viewer } of this.tabs) if (viewer) viewer.canvas.hidden = true;
    element("pictures", HTMLDivElement).hidden = false;
    this.placeMark();
    this.say(`The field cannot be shown: ${reason}`);
  }

  /**
   * @param {string} text
   */
  say(text) {
    element("message", HTMLParagraphElement).textContent = text;
  }

  /** Gives the shown pictures the colour of the page's paper, in light and in dark. */
  setPaper() {
    const isDark = matchMedia("(prefers-color-scheme: dark)").matches;
    for (const { painter } of this.shownViewers()) {
      painter.paper = isDark ? [0.0109, 0.0123, 0.0152] : [0.9559734, 0.9559734, 0.9386857];
      painter.ink = isDark ? [0.85, 0.86, 0.88] : [0.08, 0.09, 0.13];
    }
  }

  showTabs() {
    const tabs = element("tabs", HTMLElement);
    const title = document.querySelector("header h1");
    if (title instanceof HTMLElement) title.hidden = this.tabs.length > 1 && title.textContent === this.tabs.map(({ name }) => name).join(", ");
    tabs.hidden = this.tabs.length < 2;
    tabs.replaceChildren(
      ...this.tabs.map((tab) => {
        const button = document.createElement("button");
        button.type = "button";
        button.textContent = tab.name;
        button.setAttribute("aria-pressed", String(tab === this.tab));
        button.addEventListener("click", () => this.choose(tab, this.beside));
        return button;
      }),
    );
    element("beside-label", HTMLLabelElement).hidden = this.tabs.length < 2;
    /** @type {[string, string][]} */
    const others = this.tabs.map((tab, n) => [String(n), tab.name]);
    setChoices(element("beside", HTMLSelectElement), [["none", "none"], ...others], this.beside ? String(this.tabs.indexOf(this.beside)) : "none");
  }

  /** Points to the marked place in each picture that shows it. */
  placeMark() {
    for (const mark of document.querySelectorAll(".mark")) mark.remove();
    for (const viewer of this.shownViewers()) {
      const { canvas, field } = viewer;
      const { mark, kind, normal, point } = this.view;
      if (!mark || (kind === "slice" && Math.abs(dot(normal, subtract(mark, point))) > 1e-4 * diagonalOf(field))) continue;
      const place = viewer.project(mark);
      if (!place) continue;
      const ring = Object.assign(document.createElement("i"), { className: "mark" });
      ring.style.left = `${canvas.offsetLeft + place[0]}px`;
      ring.style.top = `${canvas.offsetTop + place[1]}px`;
      element("stage", HTMLDivElement).append(ring);
    }
  }

  /**
   * Shows the view that lines of a script describe.
   * @param {string} lines
   */
  apply(lines) {
    const { view, problems } = viewFrom(lines, this.view, this.field);
    this.theView = view;
    this.say(problems.join(" "));
    fitPlanes(view, this.field);
    for (const viewer of this.viewers) viewer.view = this.view;
    this.changed();
  }

  listen() {
    element("beside", HTMLSelectElement).addEventListener("change", (event) => {
      const { value } = /** @type {HTMLSelectElement} */ (event.target);
      this.choose(this.tab, value === "none" ? null : this.tabs[Number(value)]);
    });
    element("apply", HTMLButtonElement).addEventListener("click", () => this.apply(element("script", HTMLTextAreaElement).value));
    element("copy", HTMLButtonElement).addEventListener("click", () => this.copyView());
    element("png", HTMLButtonElement).addEventListener("click", () => this.savePng());
  }

  /**
   * Listens to mouse, fingers and keys on a canvas.
   * @param {Viewer} viewer
   */
  listenTo(viewer) {
    const { canvas } = viewer;
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.onPick) this.say("");
      canvas.setPointerCapture(event.pointerId);
      if (this.pointers.size === 0) this.moved = 0;
      this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    canvas.addEventListener("pointermove", (event) => this.move(viewer, event));
    canvas.addEventListener("pointerup", (event) => this.release(viewer, event));
    canvas.addEventListener("pointercancel", (event) => this.pointers.delete(event.pointerId));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(event.deltaY * 0.001));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /**
   * @param {Viewer} viewer
   * @param {Pick | null} pick
   */
  readOut(viewer, pick) {
    const other = this.tabs.find((tab) => tab.viewer && tab.viewer !== viewer && this.viewers.includes(tab.viewer));
    showReadout(viewer.field, pick, other?.viewer ? { name: other.name, field: other.viewer.field } : null);
  }

  /**
   * @param {Viewer} viewer
   * @param {PointerEvent} event
   */
  move(viewer, event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return this.readOut(viewer, viewer.pick(event.clientX, event.clientY));
    const dx = event.clientX - before.x, dy = event.clientY - before.y;
    this.moved += Math.abs(dx) + Math.abs(dy);
    const { clientWidth: width, clientHeight: height } = viewer.canvas;
    const share = 1 / this.pointers.size; // two fingers that move together move the picture once
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (other) {
      const apart = (/** @type {{x: number, y: number}} */ p) => Math.hypot(p.x - other.x, p.y - other.y);
      this.zoomView(apart(before) / Math.max(apart({ x: event.clientX, y: event.clientY }), 1));
      viewer.pan((share * dx) / width, (share * dy) / height);
    } else if (event.ctrlKey) {
      this.movePlane(-dy / height);
    } else if (event.altKey) {
      this.tiltPlane(viewer, dx / width, dy / height);
    } else if (this.view.kind === "slice" || event.buttons === 2 || event.shiftKey) {
      viewer.pan(dx / width, dy / height);
    } else {
      this.turnView(-0.4 * dx, 0.4 * dy);
    }
    this.changed();
  }

  /**
   * @param {Viewer} viewer
   * @param {PointerEvent} event
   */
  release(viewer, event) {
    this.pointers.delete(event.pointerId);
    const pick = this.moved < 4 ? viewer.pick(event.clientX, event.clientY) : null;
    if (!pick) return;
    this.readOut(viewer, pick);
    this.onPick?.(pick);
  }

  /**
   * @param {number} azimuth
   * @param {number} elevation
   */
  turnView(azimuth, elevation) {
    const { orbit } = this.view;
    orbit.azimuth += azimuth;
    orbit.elevation = within(orbit.elevation + elevation, [-90, 90]);
  }

  /**
   * @param {number} factor  above 1 farther away
   */
  zoomView(factor) {
    const { view } = this;
    if (view.kind === "slice") view.zoom = within(view.zoom / factor, ZOOMS);
    else view.orbit.distance = within(view.orbit.distance * factor, DISTANCES);
  }

  /**
   * @param {number} factor
   */
  zoom(factor) {
    this.zoomView(factor);
    this.changed();
  }

  /**
   * Moves the slice's plane along its normal, or in a cut surface without a plane the cut, by a share of the domain's diagonal.
   * @param {number} share
   */
  movePlane(share) {
    const { view, field } = this;
    const length = share * diagonalOf(field);
    if (view.kind === "surface" && view.clip && !view.planeInSpace) {
      const { axis, at } = view.clip;
      view.clip.at = within(at + length, [field.lower[axis], field.upper[axis]]);
    } else {
      movePlaneTo(view, field, placeOfPlane(view, field) + length);
    }
  }

  /**
   * Tilts the slice's plane about the axes of its picture.
   * @param {Viewer} viewer
   * @param {number} x
   * @param {number} y
   */
  tiltPlane(viewer, x, y) {
    const { view, field } = this;
    const middle = planeOf(view, field, viewer.canvas.width, viewer.canvas.height).origin;
    const [right, up] = screenAxes(view.normal);
    const facing = view.kind === "surface" && dot(view.normal, raysOf(view.orbit, field, 1).forward) > 0 ? -1 : 1;
    setPlane(view, field, middle, add(view.normal, add(scaled(right, 2 * facing * x), scaled(up, -2 * facing * y))));
  }

  /**
   * @param {KeyboardEvent} event
   */
  key(event) {
    const { view, viewer } = this;
    const step = 5;
    const isSlice = view.kind === "slice";
    const place = (/** @type {number} */ axis) => () => {
      setPlane(view, this.field, view.point, /** @type {Vector} */ ([0, 1, 2].map((a) => (a === axis ? 1 : 0))));
    };
    /** @type {Record<string, () => void>} */
    const actions = {
      ArrowLeft: () => (isSlice ? viewer.pan(0.05, 0) : this.turnView(step, 0)),
      ArrowRight: () => (isSlice ? viewer.pan(-0.05, 0) : this.turnView(-step, 0)),
      ArrowUp: () => (isSlice ? viewer.pan(0, 0.05) : this.turnView(0, step)),
      ArrowDown: () => (isSlice ? viewer.pan(0, -0.05) : this.turnView(0, -step)),
      PageUp: () => this.movePlane(0.01),
      PageDown: () => this.movePlane(-0.01),
      "+": () => this.zoomView(0.8),
      "-": () => this.zoomView(1.25),
      s: () => (view.kind = isSlice ? "surface" : "slice"),
      x: place(0),
      y: place(1),
      z: place(2),
      Escape: () => {
        this.onPick = null;
        view.mark = null;
        this.say("");
      },
      Home: () => Object.assign(view, firstView(this.field), { kind: view.kind }),
    };
    const action = event.ctrlKey || event.metaKey ? undefined : actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
    this.changed();
  }

  copyView() {
    const lines = scriptOf(this.view, this.field);
    navigator.clipboard?.writeText(lines).then(
      () => this.say("The view is copied: lines of a script of the program, which this page reads too."),
      () => this.say("The browser does not let the page copy; the lines stand in the panel “view”."),
    );
  }

  /** Saves the picture as it is on the canvas. */
  savePng() {
    this.viewer.canvas.toBlob((blob) => {
      if (!blob) return this.say("The browser could not write the picture.");
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = `${this.tab.name}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    });
  }
}

async function start() {
  const page = new Page();
  window.addEventListener("error", ({ error }) => error && page.say(`An error in the page: ${error}`));
  window.addEventListener("unhandledrejection", (event) => page.say(`An error in the page: ${event.reason}`));
  await page.start();
  // Tests and curious readers find the page here, with functions to ask it.
  const functions = { query, firstView, planeOf, raysOf, scriptOf, viewFrom, degreeOf, axisAlong, pickAt, add, scaled, cellErrors, forEachLeaf, Jumps, FaceMeter, sampleLine, thicknessAt, distanceBetween };
  Object.assign(window, { hpsdf: { page, field: page.tab.field, ...functions } });
}

start();
