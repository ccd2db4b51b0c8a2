// Turns the buffers of a view into colours on a canvas.

import { degreeOf, isLeaf } from "../field/field_file.js";
import { forEachLeaf } from "../field/leaves.js";
import { divergingColor, levelColor, orderedColor } from "./colors.js";
import { FieldRenderer, NO_CELL, shownBox } from "./renderer.js";
import { CellLines } from "./cell_lines.js";
import { worldPoint } from "../field/query.js";
import { planeOf } from "./view.js";
import { raysOf } from "./camera.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("./view.js").View} View */
/** @typedef {import("./view.js").Quantity} Quantity */
/** @typedef {import("./colors.js").Color} Color */
/** @typedef {import("./camera.js").Rays} Rays */
/** @typedef {import("./renderer.js").Buffers} Buffers */
/** @typedef {import("./renderer.js").Target} Target */
/** @typedef {import("./renderer.js").Job} Job */
/** @typedef {import("./renderer.js").ColorTarget} ColorTarget */

const STEPS = 256; // of a continuous scale

/**
 * The levels that occur, each with its share of the volume and its colour.
 * @typedef {{level: number, share: number, color: Color}[]} Levels
 */

/**
 * Returns the share of the volume of each level that occurs.
 * @param {Field} field
 * @param {(node: number, depth: number) => number} levelOf
 * @returns {Map<number, number>}
 */
function sharesOf(field, levelOf) {
  const shares = new Map();
  const bases = field.grid[0] * field.grid[1] * field.grid[2];
  forEachLeaf(field, (node, depth) => {
    const level = levelOf(node, depth);
    shares.set(level, (shares.get(level) ?? 0) + 8 ** -depth / bases);
  });
  return shares;
}

/**
 * Returns the levels that occur in any of some fields, with their shares in the first one.
 * @param {Map<number, number>[]} shares
 * @returns {Levels}
 */
function levelsOf(shares) {
  const levels = [...new Set(shares.flatMap((own) => [...own.keys()]))].sort((a, b) => a - b);
  return levels.map((level) => ({ level, share: shares[0].get(level) ?? 0, color: levelColor(level) }));
}

/**
 * A picture: its view, and the buffers that hold it once the jobs are done.
 * @typedef {object} Drawing
 * @property {View} view
 * @property {number} scale  pixels of the buffers for each pixel of the canvas
 * @property {Rays} rays
 * @property {Target} hits
 * @property {Target | null} section
 * @property {ColorTarget} colors
 * @property {Job[]} jobs
 */

/**
 * Returns true where a section hides the surface, as isSectioned in picture.frag.
 * @param {{cell: number, levels: number, distance: number}} section
 * @param {{cell: number, distance: number}} hit
 */
export function isSectionShown(section, hit) {
  if (section.cell === NO_CELL) return false;
  return hit.cell === NO_CELL || section.levels >>> 24 === 1 || section.distance < hit.distance;
}

/** A field with what is needed to draw it, on one canvas. */
export class Painter {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Field} field
   * @param {Record<string, string>} sources
   */
  constructor(canvas, field, sources) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.canvas = canvas;
    this.gl = gl;
    this.field = field;
    this.renderer = new FieldRenderer(gl, field, sources);
    const vertex = "#version 300 es\n" + sources["full_screen.vert"];
    this.renderer.shaders.coloring = () => [vertex, sources["picture.frag"]];
    this.renderer.shaders.lining = () => [sources["cells.vert"], sources["cells.frag"]];
    this.lineArray = gl.createVertexArray();
    this.lineBuffer = gl.createBuffer();
    gl.bindVertexArray(this.lineArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineBuffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 4, gl.FLOAT, false, 0, 0);
    this.linesOf = "none"; // the cells whose edges are on the graphics card
    this.edges = 0;
    /** @type {{cells: string, lines: CellLines} | null} */
    this.collected = null; // edges that are being collected
    /** @type {Map<Quantity, {texture: WebGLTexture, decades: [number, number]}>} */
    this.cellNumbers = new Map(); // quantities of which each cell has one number
    /** @type {Color} */
    this.paper = [1, 1, 1];
    /** @type {Color} */
    this.ink = [0, 0, 0];
    this.shares = { degree: sharesOf(field, (node) => degreeOf(field, node)), depth: sharesOf(field, (_, depth) => depth) };
    this.ownRange = this.rangeOfDistance();
    this.scales = {
      degree: this.scaleTexture(new Float32Array(8 * STEPS)),
      depth: this.scaleTexture(new Float32Array(8 * STEPS)),
      distance: this.continuousScale((t) => divergingColor(2 * t - 1)),
      ordered: this.continuousScale(orderedColor),
    };
    /** @type {Levels} */
    this.degrees = [];
    /** @type {Levels} */
    this.depths = [];
    this.range = this.ownRange;
    /** @type {Painter[]} */
    this.group = [];
    this.shareScales([this]);
  }

  /**
   * Gives this painter the same scales of colours as others whose pictures stand beside its own.
   * @param {Painter[]} painters  this one among them
   */
  shareScales(painters) {
    const others = painters.filter((painter) => painter !== this);
    this.group = [this, ...others];
    this.degrees = levelsOf(this.group.map(({ shares }) => shares.degree));
    this.depths = levelsOf(this.group.map(({ shares }) => shares.depth));
    this.range = Math.max(...this.group.map(({ ownRange }) => ownRange));
    for (const name of /** @type {const} */ (["degree", "depth"])) {
      this.gl.deleteTexture(this.scales[name]);
      this.scales[name] = this.levelScale(name === "degree" ? this.degrees : this.depths);
    }
  }

  /**
   * Returns the powers of ten at the ends of the scale of a quantity of which each cell has one number, or null before it is known.
   * @param {Quantity} quantity
   * @returns {[number, number] | null}
   */
  decadesOf(quantity) {
    const known = this.group.flatMap(({ cellNumbers }) => cellNumbers.get(quantity)?.decades ?? []);
    return this.cellNumbers.has(quantity) ? [Math.min(...known), Math.max(...known)] : null;
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
    return this.renderer.plainTexture(gl.RGBA32F, STEPS, 2, gl.RGBA, gl.FLOAT, texels);
  }

  /**
   * @param {Levels} levels
   */
  levelScale(levels) {
    const texels = new Float32Array(8 * STEPS);
    for (const { level, color } of levels) texels.set(color, 4 * level);
    return this.scaleTexture(texels);
  }

  /**
   * @param {(t: number) => Color} colorAt  for t from 0 to 1
   */
  continuousScale(colorAt) {
    const texels = new Float32Array(8 * STEPS);
    for (let i = 0; i < STEPS; ++i) texels.set(colorAt(i / (STEPS - 1)), 4 * (STEPS + i));
    return this.scaleTexture(texels);
  }

  /**
   * Gives each cell a number of a quantity by which cells can be coloured.
   * @param {Quantity} quantity
   * @param {Float32Array} numbers  for each node
   * @param {[number, number]} decades  powers of ten at the ends of the scale
   */
  setCellNumbers(quantity, numbers, decades) {
    const { renderer, gl } = this;
    this.cellNumbers.set(quantity, { texture: renderer.texture(gl.R32F, numbers, 1), decades });
  }

  /**
   * Returns what has to be drawn before a view can be painted, with `scale` pixels of the buffers for each of the canvas.
   * @param {View} view
   * @param {number} scale
   * @param {Buffers} buffers
   * @returns {Drawing}
   */
  drawing(view, scale, buffers) {
    const { canvas, renderer, field } = this;
    const width = Math.max(Math.round(canvas.width * scale), 1);
    const height = Math.max(Math.round(canvas.height * scale), 1);
    const rays = raysOf(view.orbit, field, width / height);
    const shown = structuredClone(view);
    if (view.kind === "slice") {
      const job = renderer.sliceJob(buffers, planeOf(view, field, width, height), width, height);
      return this.withColors({ view: shown, scale, rays, hits: job.hits, section: null, colors: buffers.resizeColors(width, height), jobs: [job] });
    }
    const jobs = [renderer.surfaceJob(buffers, rays, width, height, view.offset, view.clip)];
    if (view.clip || view.planeInSpace) jobs.push(renderer.sectionJob(buffers, rays, width, height, view.offset, view.clip, view.planeInSpace ? view : null));
    return this.withColors({ view: shown, scale, rays, hits: jobs[0].hits, section: jobs[1]?.hits ?? null, colors: buffers.resizeColors(width, height), jobs });
  }

  /**
   * Adds the job that colours a drawing.
   * @param {Drawing} drawing
   */
  withColors(drawing) {
    drawing.jobs.push(this.colorJob(drawing));
    return drawing;
  }

  /**
   * Colours the buffers of a drawing. The portions are rows of pixels.
   * @param {Drawing} drawing
   * @returns {Job}
   */
  colorJob({ view, rays, hits, section, colors }) {
    const { gl, renderer } = this;
    const isSlice = view.kind === "slice";
    const quantity = isSlice ? view.sliceColor : view.surfaceColor;
    const draw = (/** @type {number} */ first, /** @type {number} */ count) => {
      const { mode, texture, range, ofCells } = this.coloringOf(quantity);
      colors.bind([gl.COLOR_ATTACHMENT0]);
      const coloring = renderer.program("coloring");
      renderer.checkLinked(coloring);
      gl.useProgram(coloring);
      const at = (/** @type {string} */ name) => renderer.at(coloring, name);
      this.bindTextures(coloring, { integers: hits.integers, floats: hits.floats, scale: texture, ofCells: ofCells ?? hits.floats, section: (section ?? hits).integers });
      gl.uniform1i(at("isSlice"), isSlice ? 1 : 0);
      gl.uniform1i(at("hasSection"), section ? 1 : 0);
      gl.uniform1i(at("mode"), mode);
      gl.uniform2f(at("range"), ...range);
      gl.uniform3f(at("paper"), ...this.paper);
      this.setCamera(coloring, rays);
      gl.uniform1f(at("isoStep"), quantity === "distance" ? this.range / 12 : 0);
      gl.uniform1i(at("outlines"), quantity === "distance" || quantity === "normal" ? 0 : 1);
      renderer.drawRows(first, count, hits.width);
    };
    return { kind: "colors", programs: ["coloring"], hits, size: hits.height, draw };
  }

  /**
   * Brings a drawing whose jobs are done to the canvas.
   * @param {Drawing} drawing
   */
  paint({ scale, colors }) {
    const { gl, canvas } = this;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, colors.frame);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    // Rows of the buffers run from the top down, those of the canvas from the bottom up.
    gl.blitFramebuffer(0, 0, colors.width, colors.height, 0, canvas.height, canvas.width, 0, gl.COLOR_BUFFER_BIT, scale === 1 ? gl.NEAREST : gl.LINEAR);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, canvas.width, canvas.height);
  }

  /**
   * @param {WebGLProgram} program
   * @param {Record<string, WebGLTexture>} textures
   */
  bindTextures(program, textures) {
    const { gl, renderer } = this;
    Object.entries(textures).forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(renderer.at(program, name), unit);
    });
  }

  /**
   * @param {WebGLProgram} program
   * @param {Rays} rays
   */
  setCamera(program, rays) {
    const { gl, renderer } = this;
    gl.uniform3f(renderer.at(program, "forward"), ...rays.forward);
    gl.uniform3f(renderer.at(program, "right"), ...rays.right);
    gl.uniform3f(renderer.at(program, "up"), ...rays.up);
    gl.uniform1i(renderer.at(program, "parallel"), rays.parallel ? 1 : 0);
  }

  /**
   * Returns how a quantity is coloured: the mode of picture.frag, its scale and the range of the scale.
   * @param {Quantity} quantity
   * @returns {{mode: number, texture: WebGLTexture, range: [number, number], ofCells?: WebGLTexture}}
   */
  coloringOf(quantity) {
    const cells = this.cellNumbers.get(quantity), decades = this.decadesOf(quantity);
    if (cells && decades) return { mode: 4, texture: this.scales.ordered, range: [decades[0] * Math.LN10, decades[1] * Math.LN10], ofCells: cells.texture };
    const range = /** @type {[number, number]} */ ([-this.range, this.range]);
    if (quantity === "depth") return { mode: 2, texture: this.scales.depth, range };
    if (quantity === "distance") return { mode: 3, texture: this.scales.distance, range };
    return { mode: quantity === "degree" ? 1 : 0, texture: this.scales.degree, range };
  }

  /**
   * Draws the edges of cells over the picture of a surface that is on the canvas. The portions are edges, which `prepareLines` has
   * brought to the graphics card.
   * @param {Drawing} drawing
   * @returns {Job}
   */
  lineJob({ view, scale, rays, hits, section }) {
    const { gl, canvas, renderer, field } = this;
    const draw = (/** @type {number} */ first, /** @type {number} */ count) => {
      const lining = renderer.program("lining");
      renderer.checkLinked(lining);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.useProgram(lining);
      const at = (/** @type {string} */ name) => renderer.at(lining, name);
      this.bindTextures(lining, { integers: hits.integers, section: (section ?? hits).integers });
      gl.uniform1i(at("hasSection"), section ? 1 : 0);
      gl.uniform1f(at("scaleOfBuffers"), scale);
      gl.uniform1f(at("height"), canvas.height);
      gl.uniform3f(at("eye"), ...rays.eye);
      gl.uniform3f(at("ink"), ...this.ink);
      const [lower, upper] = shownBox(field, rays, view.clip);
      gl.uniform3f(at("shownLo"), ...worldPoint(field, lower));
      gl.uniform3f(at("shownHi"), ...worldPoint(field, upper));
      this.setCamera(lining, rays);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      gl.bindVertexArray(this.lineArray);
      gl.drawArrays(gl.LINES, 2 * first, 2 * count);
      gl.disable(gl.BLEND);
    };
    return { kind: "lines", programs: ["lining"], hits, size: this.edges, draw };
  }

  /**
   * Collects the edges of these cells for some milliseconds. Returns true when they are on the graphics card.
   * @param {string} cells  as in a view
   * @param {number} milliseconds
   */
  prepareLines(cells, milliseconds) {
    const { gl } = this;
    if (cells === this.linesOf) return true;
    if (!this.collected || this.collected.cells !== cells) this.collected = { cells, lines: new CellLines(this.field, cells) };
    const { lines } = this.collected;
    if (!lines.run(milliseconds)) return false;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, lines.numbers.subarray(0, lines.count), gl.STATIC_DRAW);
    this.edges = lines.ends / 2;
    this.linesOf = cells;
    this.collected = null;
    return true;
  }
}
