// Shows a field on a canvas: a coarse picture while the view changes, the sharp one when it rests. Nothing waits for the graphics card:
// it gets so much to do at a time that it is done soon, and a change of the view ends what is under way.

import { centreOf, diagonalOf, raysOf } from "./camera.js";
import { pickAt } from "./pick.js";
import { Painter } from "./painter.js";
import { Buffers } from "./renderer.js";
import { add, dot, scaled, subtract } from "../field/vector.js";
import { planeOf } from "./view.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */
/** @typedef {import("./painter.js").Drawing} Drawing */
/** @typedef {import("./renderer.js").Job} Job */
/** @typedef {import("./view.js").View} View */

const FRAME_TIME = 45; // milliseconds that a coarse picture may take
const LEAST_SCALE = 0.1;
const PORTION_TIME = 50; // milliseconds that a portion of the sharp picture may take
const FIRST_SHARE = 0.02; // of a job, at first
const MOST_SHARE = 0.25;
const COLLECTING_TIME = 10; // milliseconds that the edges of cells are collected at a time
const FEW_EDGES = 30_000; // that a coarse picture shows
const REST = 150; // milliseconds without a change until the sharp picture is begun

/**
 * @param {number} milliseconds
 * @returns {Promise<void>}
 */
function pause(milliseconds) {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}

/** A field on a canvas. */
export class Viewer {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Field} field
   * @param {Record<string, string>} sources
   * @param {View} view  which others may change; they call `changed` then
   * @param {{changed: () => unknown, painted: (viewer: Viewer) => unknown, rested: () => void, failed: (error: unknown) => void}} listener
   */
  constructor(canvas, field, sources, view, listener) {
    this.canvas = canvas;
    this.field = field;
    this.view = view;
    this.listener = listener;
    this.painter = new Painter(canvas, field, sources);
    this.coarse = new Buffers(this.painter.renderer);
    this.sharp = new Buffers(this.painter.renderer);
    this.scale = 2 * LEAST_SCALE; // pixels of the buffers for each of the canvas while the view changes
    /** @type {Map<string, number>} */
    this.shares = new Map(); // what part of a job of each kind is done at a time
    this.isStale = false;
    this.isRunning = false;
    this.isSharp = false;
    this.longest = 0; // milliseconds of the longest wait for the graphics card, for tests
    /** @type {Drawing | null} */
    this.shown = null;
    this.isRemoved = false;
    canvas.addEventListener("webglcontextlost", () => this.fail(new Error("the graphics card was lost; load the page again")));
  }

  /** Gives the canvas and what the graphics card holds back. */
  remove() {
    this.isRemoved = true;
    this.canvas.remove();
    this.painter.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }

  /**
   * @param {unknown} error
   */
  fail(error) {
    if (!this.isRemoved) this.listener.failed(error);
  }

  /** Fits the canvas to its place on the page. */
  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(Math.round(this.canvas.clientWidth * ratio), 1);
    const height = Math.max(Math.round(this.canvas.clientHeight * ratio), 1);
    if (width === this.canvas.width && height === this.canvas.height) return;
    this.canvas.width = width;
    this.canvas.height = height;
    this.changed();
  }

  /** Draws the view anew, as soon as what is under way ends. */
  changed() {
    this.isStale = true;
    this.isSharp = false;
    this.listener.changed();
    if (!this.isRunning) this.run();
  }

  async run() {
    this.isRunning = true;
    try {
      while (this.isStale && !this.isRemoved) {
        await new Promise((resolve) => requestAnimationFrame(resolve));
        this.isStale = false;
        await this.drawCoarse();
        for (let waited = 0; waited < REST && !this.isStale; waited += 15) await pause(15);
        if (!this.isStale) await this.drawSharp();
      }
    } catch (error) {
      this.fail(error);
    } finally {
      this.isRunning = false;
    }
    this.listener.rested();
  }

  async drawCoarse() {
    const drawing = this.painter.drawing(this.view, this.scale, this.coarse);
    const programs = drawing.jobs.flatMap((job) => job.programs);
    while (!this.painter.renderer.areCompiled(programs)) await pause(5);
    const begin = performance.now();
    const isFirst = !this.shown; // it takes longer, because programs are made ready
    for (const { draw, size } of drawing.jobs) if (size > 0) draw(0, size);
    this.show(drawing);
    this.drawFewLines(drawing);
    await this.done();
    const taken = performance.now() - begin;
    if (!isFirst) this.scale = Math.min(Math.max(this.scale * Math.sqrt(FRAME_TIME / Math.max(taken, 1)), LEAST_SCALE), 1);
  }

  /**
   * Draws the edges of cells over a coarse picture, if there are few.
   * @param {Drawing} drawing
   */
  drawFewLines(drawing) {
    const { painter } = this;
    const { kind, cells } = drawing.view;
    if (kind === "surface" && cells !== "none" && cells === painter.linesOf && painter.edges <= FEW_EDGES) painter.lineJob(drawing).draw(0, painter.edges);
  }

  async drawSharp() {
    const { painter, view } = this;
    const hasLines = view.kind === "surface" && view.cells !== "none";
    while (hasLines && !this.isStale && !painter.prepareLines(view.cells, COLLECTING_TIME)) await pause(0);
    if (hasLines || this.shown?.scale !== 1) {
      const drawing = painter.drawing(view, 1, this.sharp);
      for (const job of drawing.jobs) await this.drawInPortions(job);
      if (this.isStale) return;
      this.show(drawing);
      if (hasLines) await this.drawInPortions(painter.lineJob(drawing));
    }
    this.isSharp = !this.isStale;
  }

  /**
   * @param {Job} job
   */
  async drawInPortions({ kind, size, draw, resume }) {
    for (let at = 0; at < size && !this.isStale; ) {
      const share = this.shares.get(kind) ?? FIRST_SHARE;
      const count = Math.max(Math.min(Math.round(share * size), size - at), 1);
      const begin = performance.now();
      draw(at, count);
      await this.done();
      while (!this.isStale && resume?.(at, count)) await this.done();
      at += count;
      const faster = PORTION_TIME / Math.max(performance.now() - begin, 1);
      this.shares.set(kind, Math.min(Math.max(share * Math.min(faster, 1.5), 1e-3), MOST_SHARE));
    }
  }

  /** Waits until the graphics card has done what it was told. */
  async done() {
    const { gl } = this.painter;
    const begin = performance.now();
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    if (!fence) return;
    while (gl.clientWaitSync(fence, 0, 0) === gl.TIMEOUT_EXPIRED) await pause(2);
    gl.deleteSync(fence);
    this.longest = Math.max(this.longest, performance.now() - begin);
  }

  /**
   * @param {Drawing} drawing
   */
  show(drawing) {
    this.painter.paint(drawing);
    this.shown = drawing;
    this.listener.painted(this);
  }

  /**
   * Returns what the picture shows at a place of the page, or null.
   * @param {number} clientX
   * @param {number} clientY
   */
  pick(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect();
    const x = (clientX - box.left) / box.width, y = (clientY - box.top) / box.height;
    if (!this.shown || !(x >= 0 && x < 1 && y >= 0 && y < 1)) return null;
    return pickAt(this.field, this.shown, x, y);
  }

  /**
   * Returns where the picture shows a point: pixels of the page from the canvas's upper left corner, or null behind the eye.
   * @param {Vector} point
   * @returns {[number, number] | null}
   */
  project(point) {
    const { canvas, field, view } = this;
    const { clientWidth: width, clientHeight: height } = canvas;
    const isSlice = view.kind === "slice";
    const rays = raysOf(view.orbit, field, width / height);
    const { origin, right, up } = isSlice ? planeOf(view, field, width, height) : { origin: rays.eye, right: rays.right, up: rays.up };
    const away = subtract(point, origin);
    const depth = isSlice || rays.parallel ? 1 : dot(away, rays.forward);
    if (!(depth > 0)) return null;
    const u = dot(away, right) / dot(right, right) / depth, v = dot(away, up) / dot(up, up) / depth;
    return [0.5 * (1 + u) * width, 0.5 * (1 - v) * height];
  }

  /**
   * Moves the picture by shares of its width and height.
   * @param {number} x
   * @param {number} y
   */
  pan(x, y) {
    const { view, field, canvas } = this;
    if (view.kind === "slice") {
      const plane = planeOf(view, field, canvas.width, canvas.height);
      view.target = add(plane.origin, add(scaled(plane.right, -2 * x), scaled(plane.up, 2 * y)));
    } else {
      const rays = raysOf(view.orbit, field, canvas.width / canvas.height);
      const reach = rays.parallel ? 1 : view.orbit.distance * diagonalOf(field);
      view.orbit.target = add(view.orbit.target ?? centreOf(field), add(scaled(rays.right, -2 * x * reach), scaled(rays.up, 2 * y * reach)));
    }
  }
}
