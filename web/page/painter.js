// Turns the buffers of a view into colours on a canvas.

import { degreeOf, isLeaf } from "./field_file.js";
import { forEachLeaf } from "./leaves.js";
import { divergingColor, exactColor, orderedColor } from "./colors.js";
import { FieldRenderer } from "./renderer.js";
import { planeOf } from "./view.js";
import { raysOf } from "./camera.js";

/** @typedef {import("./field_file.js").Field} Field */
/** @typedef {import("./view.js").View} View */
/** @typedef {import("./colors.js").Color} Color */

const MODES = { normal: 0, degree: 1, depth: 2, distance: 3 };
const STEPS = 256; // of a continuous scale

/**
 * The levels that occur, each with its share of the volume and its colour.
 * @typedef {{level: number, share: number, color: Color}[]} Levels
 */

/**
 * @param {Field} field
 * @param {(node: number, depth: number) => number} levelOf
 * @returns {Levels}
 */
function levelsOf(field, levelOf) {
  const shares = new Map();
  const bases = field.grid[0] * field.grid[1] * field.grid[2];
  forEachLeaf(field, (node, depth) => {
    const level = levelOf(node, depth);
    shares.set(level, (shares.get(level) ?? 0) + 8 ** -depth / bases);
  });
  const levels = [...shares.keys()].sort((a, b) => a - b);
  const ordered = levels.filter((level) => level !== 31);
  return levels.map((level) => {
    const at = ordered.length === 1 ? 0.5 : ordered.indexOf(level) / (ordered.length - 1);
    return { level, share: shares.get(level), color: level === 31 ? exactColor() : orderedColor(at) };
  });
}

/** A field with what is needed to draw it, on one canvas. */
export class Painter {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Field} field
   * @param {Record<string, string>} sources
   * @param {string} pictureShader
   */
  constructor(canvas, field, sources, pictureShader) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.canvas = canvas;
    this.gl = gl;
    this.field = field;
    this.renderer = new FieldRenderer(gl, field, sources);
    const vertex = "#version 300 es\n" + sources["full_screen.vert"];
    this.coloring = this.renderer.program(vertex, pictureShader);
    this.degrees = levelsOf(field, (node) => degreeOf(field, node));
    this.depths = levelsOf(field, (_, depth) => depth);
    this.range = this.rangeOfDistance();
    this.scales = { degree: this.levelScale(this.degrees), depth: this.levelScale(this.depths), distance: this.distanceScale() };
  }

  /** A bound of the field's magnitude, for colours. */
  rangeOfDistance() {
    let most = 0;
    for (let n = 0; n < this.field.low.length; ++n) if (isLeaf(this.field, n)) most = Math.max(most, Math.abs(this.renderer.bounds.linear[4 * n + 3]));
    return most;
  }

  /**
   * @param {Float32Array} texels  32 colours of levels, then those of a continuous scale, in rows of STEPS
   */
  scaleTexture(texels) {
    const { gl } = this;
    const texture = this.renderer.plainTexture(gl.RGBA32F, STEPS, 2, gl.RGBA, gl.FLOAT, texels);
    return texture;
  }

  /**
   * @param {Levels} levels
   */
  levelScale(levels) {
    const texels = new Float32Array(8 * STEPS);
    for (const { level, color } of levels) texels.set(color, 4 * level);
    return this.scaleTexture(texels);
  }

  distanceScale() {
    const texels = new Float32Array(8 * STEPS);
    for (let i = 0; i < STEPS; ++i) texels.set(divergingColor((2 * i) / (STEPS - 1) - 1), 4 * (STEPS + i));
    return this.scaleTexture(texels);
  }

  /**
   * Draws a view on the canvas with `scale` pixels of the buffers for each of the canvas.
   * @param {View} view
   * @param {number} scale
   */
  draw(view, scale) {
    const { gl, canvas } = this;
    const width = Math.max(Math.round(canvas.width * scale), 1);
    const height = Math.max(Math.round(canvas.height * scale), 1);
    const isSlice = view.kind === "slice";
    const rays = raysOf(view.orbit, this.field, width / height);
    const hits = isSlice ? this.renderer.slice(planeOf(view, this.field, width, height), width, height) : this.renderer.surface(rays, width, height, view.offset);
    const quantity = isSlice ? view.sliceColor : view.surfaceColor;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.useProgram(this.coloring);
    const at = (/** @type {string} */ name) => gl.getUniformLocation(this.coloring, name);
    const scales = { normal: this.scales.degree, ...this.scales };
    [["integers", hits.integers], ["floats", hits.floats], ["scale", scales[quantity]], ["ofCells", hits.floats]].forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, /** @type {WebGLTexture} */ (texture));
      gl.uniform1i(at(/** @type {string} */ (name)), unit);
    });
    gl.uniform1i(at("isSlice"), isSlice ? 1 : 0);
    gl.uniform1i(at("mode"), MODES[quantity]);
    gl.uniform2f(at("range"), -this.range, this.range);
    gl.uniform3f(at("forward"), ...rays.forward);
    gl.uniform3f(at("right"), ...rays.right);
    gl.uniform3f(at("up"), ...rays.up);
    gl.uniform1i(at("parallel"), rays.parallel ? 1 : 0);
    gl.uniform1f(at("isoStep"), isSlice && quantity === "distance" ? this.range / 12 : 0);
    gl.uniform1i(at("outlines"), quantity === "degree" || quantity === "depth" ? 1 : 0);
    gl.uniform1f(at("scaleOfBuffers"), scale);
    gl.bindVertexArray(this.renderer.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    return hits;
  }
}
