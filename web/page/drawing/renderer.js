// Draws fields into buffers by WebGL 2, with the program's own shaders.

import { degreeOf, isExact, isLeaf, coefficientCount, coefficientIndex } from "../field/field_file.js";
import { boundsOf } from "./bounds.js";
import { BLOCK, surfaceBlocks } from "./blocks.js";
import { gridPoint } from "../field/query.js";
import { axisVector, diagonalOf, gridPointOfPixel } from "./camera.js";
import { blendExtents } from "../field/blend.js";
import { cornersOf, signRule } from "../field/exact_leaf.js";
import { cross, dot, normalized, scaled, subtract } from "../field/vector.js";
import { ROW, webShader } from "./shaders.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */
/** @typedef {import("./camera.js").Rays} Rays */
/** @typedef {import("./camera.js").Plane} Plane */
/** @typedef {import("./bounds.js").Bounds} Bounds */

export const NO_CELL = 0xffffffff; // in place of a cell, where nothing is hit
const LOW_DEGREE = 4; // as kLowDegree in field.glsl
const OFFSET_BITS = 27;
const MOST_STEPS = 1024; // of a ray in one pass, so that a pass is short
const STEPS_IN_ALL = 1 << 16; // as in the program
const BLENDED_STEPS = 16; // an evaluation in a blend zone counts as so many steps: it evaluates at most so many leaves
const MOST_REFINEMENTS = 24;

// Draws one pixel if the march of any ray in the blocks has not ended.
const UNDER_WAY_VERTEX = `#version 300 es
precision highp usampler2D;
layout(location = 0) in vec3 block;
uniform usampler2D stateIntegers;
const uint kUnderWay = 1u;
void main() {
  bool isAny = false;
  ivec2 last = textureSize(stateIntegers, 0) - 1;
  for (int n = 0; n < ${BLOCK * BLOCK}; ++n) {
    ivec2 pixel = ivec2(block.xy) + ivec2(n % ${BLOCK}, n / ${BLOCK});
    isAny = isAny || texelFetch(stateIntegers, min(pixel, last), 0).x == kUnderWay;
  }
  gl_Position = vec4(isAny ? 0.0 : 2.0, 0.0, 0.0, 1.0);
  gl_PointSize = 1.0;
}`;
const UNDER_WAY_FRAGMENT = `#version 300 es
precision highp float;
out vec4 color;
void main() { color = vec4(1.0); }`;

/**
 * Drawing that is done in portions, so that nothing waits long for it. Rays may need more than one pass for a portion: `resume` draws
 * another one and returns true, or returns false if all rays have ended.
 * @typedef {object} Job
 * @property {string} kind
 * @property {string[]} programs  of the renderer, which it uses
 * @property {Target} hits
 * @property {number} size  number of rows or blocks
 * @property {(first: number, count: number) => void} draw
 * @property {(first: number, count: number) => boolean} [resume]
 */

/**
 * A plane that cuts the surface open; the half towards the eye is left out.
 * @typedef {{axis: number, at: number}} Clip
 */

const CLIP_NUDGE = 1e-6; // rays start so far behind a cut, as a share of the domain

/**
 * @param {Job} job
 */
function whole(job) {
  if (job.size > 0) job.draw(0, job.size);
  while (job.resume?.(0, job.size));
  return job.hits;
}

/**
 * @param {Rays} rays
 * @param {Clip} clip
 */
function isEyeAbove(rays, clip) {
  if (rays.parallel && Math.abs(rays.forward[clip.axis]) > 1e-9) return rays.forward[clip.axis] < 0;
  return rays.eye[clip.axis] >= clip.at;
}

/**
 * @param {Field} field
 * @param {Clip} clip
 * @returns {Vector}
 */
function clipPoint(field, clip) {
  return /** @type {Vector} */ (field.lower.map((x, axis) => (axis === clip.axis ? clip.at : x)));
}

/**
 * The corners of the part of the domain that a cut leaves, in grid coordinates.
 * @param {Field} field
 * @param {Rays} rays
 * @param {Clip | null} clip
 * @returns {[Vector, Vector]}
 */
export function shownBox(field, rays, clip) {
  /** @type {[Vector, Vector]} */
  const box = [[0, 0, 0], [...field.grid]];
  if (!clip) return box;
  const { axis } = clip;
  const isAbove = isEyeAbove(rays, clip);
  const cut = gridPoint(field, clipPoint(field, clip))[axis] + (isAbove ? -CLIP_NUDGE : CLIP_NUDGE) * field.grid[axis];
  box[isAbove ? 1 : 0][axis] = Math.min(Math.max(cut, 0), field.grid[axis]);
  return box;
}

/**
 * A plane in grid coordinates: the normal, and the distance from the origin along it. The greatest component of the normal is 1.
 * @param {Field} field
 * @param {Vector} point
 * @param {Vector} normal
 * @returns {number[]}
 */
function gridPlane(field, point, normal) {
  const across = normal.map((x, axis) => (x * field.size[axis]) / field.grid[axis]);
  const largest = across.reduce((most, x) => (Math.abs(x) > Math.abs(most) ? x : most), 0);
  const scaledNormal = /** @type {Vector} */ (across.map((x) => x / largest));
  return [...scaledNormal, dot(scaledNormal, gridPoint(field, point))];
}

/** An error of the graphics card, in words for the reader of the page. */
class GraphicsError extends Error {}

/**
 * @param {Field} field
 * @param {number} leaf
 */
function uploadedCount(field, leaf) {
  if (isExact(field, leaf)) return 0;
  return 4 * Math.ceil(coefficientCount(Math.max(degreeOf(field, leaf), LOW_DEGREE - 1)) / 4);
}

/**
 * Packs two numbers into one: the upper halves of their bits, rounded away from each other.
 * @param {number} low
 * @param {number} high
 */
function packOutwards(low, high) {
  const bits = new Uint32Array(new Float32Array([low, high]).buffer);
  /**
   * @param {number} x
   * @param {boolean} away
   */
  const half = (x, away) => (x >>> 16) + (away && (x & 0xffff) !== 0 ? 1 : 0);
  return ((half(bits[1], high > 0) << 16) | half(bits[0], low < 0)) >>> 0;
}

/**
 * The texels of the nodes and of the coefficients, as the shaders read them (render/src/gl/field_upload.h).
 * @param {Field} field
 * @param {Bounds} bounds
 */
function uploadOf(field, bounds) {
  const count = field.low.length;
  const nodes = new Uint32Array(4 * count);
  const bitsOf = (/** @type {Float32Array} */ numbers) => new Uint32Array(numbers.buffer);
  const value = bitsOf(bounds.value), gradient = bitsOf(bounds.gradient), second = bitsOf(bounds.second);
  let total = 0;
  for (let n = 0; n < count; ++n) if (isLeaf(field, n)) total += uploadedCount(field, n);
  const coefficients = new Float32Array(total);
  let next = 0;
  for (let n = 0; n < count; ++n) {
    nodes[4 * n + 2] = gradient[n];
    nodes[4 * n + 3] = second[n];
    if (!isLeaf(field, n)) {
      nodes[4 * n] = field.low[n];
      nodes[4 * n + 1] = packOutwards(bounds.low[n], bounds.high[n]);
      continue;
    }
    nodes[4 * n + 1] = value[n];
    const degree = degreeOf(field, n);
    if (isExact(field, n)) {
      const triangles = field.exact.lists[field.low[n]] & 0x7fffffff;
      nodes[4 * n] = ((degree << OFFSET_BITS) | (field.low[n] + 1 + ((triangles + 3) >> 2))) >>> 0;
      nodes[4 * n + 3] = (second[n] & ~3) | signRule(field, n);
      continue;
    }
    nodes[4 * n] = ((degree << OFFSET_BITS) | next) >>> 0;
    copyLeaf(field, n, coefficients, next);
    next += uploadedCount(field, n);
  }
  return { nodes, coefficients };
}

/**
 * Copies the coefficients of a leaf; terms of degree LOW_DEGREE come last.
 * @param {Field} field
 * @param {number} leaf
 * @param {Float32Array} out
 * @param {number} to
 */
function copyLeaf(field, leaf, out, to) {
  const degree = degreeOf(field, leaf);
  const from = field.first[leaf];
  const all = Math.max(degree, LOW_DEGREE - 1);
  let lower = to;
  let last = to + coefficientCount(LOW_DEGREE - 1);
  for (let i = 0; i <= all; ++i)
    for (let j = 0; j <= all - i; ++j)
      for (let k = 0; k <= all - i - j; ++k) {
        const total = i + j + k;
        const at = degree === LOW_DEGREE && total === LOW_DEGREE ? last++ : lower++;
        if (total <= degree) out[at] = field.coefficients[from + coefficientIndex(degree, i, j, k)];
      }
}

/**
 * Three texels for each triangle: its corners from the domain's lower corner, and its normal.
 * @param {Field} field
 */
function cornerTexels(field) {
  const count = field.exact.triangles.length / 3;
  const texels = new Float32Array(12 * count);
  for (let t = 0; t < count; ++t) {
    const corners = cornersOf(field.exact, t);
    const normal = normalized(cross(subtract(corners[1], corners[0]), subtract(corners[2], corners[0])));
    for (let k = 0; k < 3; ++k) texels.set([...subtract(corners[k], field.lower), normal[k]], 12 * t + 4 * k);
  }
  return texels;
}

/**
 * A texel for each node: its blend extents, and the bits of its three bounds.
 * @param {Field} field
 * @param {Float32Array} zones
 */
function zoneTexels(field, zones) {
  const bits = new Uint32Array(zones.buffer);
  const texels = new Uint32Array(4 * field.low.length);
  blendExtents(field).forEach((extents, node) => {
    texels[4 * node] = extents;
    texels.set(bits.subarray(3 * node, 3 * node + 3), 4 * node + 1);
  });
  return texels;
}

/** A field on the graphics card, and the programs that draw it. */
export class FieldRenderer {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {Field} field
   * @param {Record<string, string>} sources  the program's shaders by the names of their files
   */
  constructor(gl, field, sources) {
    this.gl = gl;
    this.field = field;
    if (!gl.getExtension("EXT_color_buffer_float")) throw new GraphicsError("this graphics card cannot draw into textures of floats");
    this.bounds = boundsOf(field);
    const { nodes, coefficients } = uploadOf(field, this.bounds);
    const hasExact = field.exact.triangles.length > 0;
    this.textures = {
      nodes: this.texture(gl.RGBA32UI, nodes, 4),
      coefficients: this.texture(gl.R32F, coefficients, 1),
      coefficientQuads: this.texture(gl.RGBA32F, coefficients, 4),
      linearParts: this.texture(gl.RGBA32F, this.bounds.linear, 4),
      zones: this.texture(gl.RGBA32UI, field.zones ? zoneTexels(field, field.zones) : new Uint32Array(4), 4),
      exactLists: this.texture(gl.R32UI, hasExact ? field.exact.lists : new Uint32Array(1), 1),
      exactCorners: this.texture(gl.RGBA32F, hasExact ? cornerTexels(field) : new Float32Array(4), 4),
    };
    const leaves = ["field.glsl", hasExact ? "leaves_exact.glsl" : "leaves_polynomial.glsl", field.blend > 0 ? "leaves_blended.glsl" : "leaves_alone.glsl"];
    const of = (/** @type {string[]} */ ...names) => webShader(names.map((name) => sources[name]));
    /** @type {Record<string, () => [string, string]>} */
    this.shaders = {
      slicing: () => [of("full_screen.vert"), of(...leaves, "slice.frag")],
      marching: () => [of("surface.vert"), of(...leaves, "surface.glsl", "surface_march.frag")],
      hitting: () => [of("surface.vert"), of(...leaves, "surface.glsl", "surface_hit.frag")],
      sectioning: () => [of("full_screen.vert"), of(...leaves, "surface.glsl", "section.frag")],
      asking: () => [UNDER_WAY_VERTEX, UNDER_WAY_FRAGMENT],
    };
    /** @type {Map<string, WebGLProgram>} */
    this.programs = new Map();
    this.parallelCompile = gl.getExtension("KHR_parallel_shader_compile");
    this.answer = new ColorTarget(this, 1, 1);
    /** @type {Map<WebGLProgram, Map<string, WebGLUniformLocation | null>>} */
    this.locations = new Map();
    this.empty = gl.createVertexArray();
    this.buffers = new Buffers(this);
  }

  /**
   * Makes a texture whose texels stand in rows of ROW.
   * @param {number} format
   * @param {Float32Array | Uint32Array} numbers
   * @param {number} components
   */
  texture(format, numbers, components) {
    const { gl } = this;
    const rows = Math.max(Math.ceil(numbers.length / components / ROW), 1);
    if (rows > gl.getParameter(gl.MAX_TEXTURE_SIZE)) throw new GraphicsError("the field is too large for this graphics card");
    const isFloat = numbers instanceof Float32Array;
    const padded = isFloat ? new Float32Array(rows * ROW * components) : new Uint32Array(rows * ROW * components);
    padded.set(numbers);
    const layout = components === 4 ? (isFloat ? gl.RGBA : gl.RGBA_INTEGER) : isFloat ? gl.RED : gl.RED_INTEGER;
    return this.plainTexture(format, ROW, rows, layout, isFloat ? gl.FLOAT : gl.UNSIGNED_INT, padded);
  }

  /**
   * @param {number} format
   * @param {number} width
   * @param {number} height
   * @param {number} layout
   * @param {number} type
   * @param {ArrayBufferView | null} data
   */
  plainTexture(format, width, height, layout, type, data) {
    const { gl } = this;
    const texture = gl.createTexture();
    if (!texture) throw new GraphicsError("the graphics card was lost");
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, layout, type, data);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return texture;
  }

  /**
   * Returns the program with one of the names in `shaders`. It is made when it is first asked for, because a picture needs few of them.
   * @param {string} name
   */
  program(name) {
    const program = this.programs.get(name) ?? this.compiled(...this.shaders[name]());
    this.programs.set(name, program);
    return program;
  }

  /**
   * Returns false while the graphics card compiles one of these programs. Using one before makes the page wait.
   * @param {string[]} names
   */
  areCompiled(names) {
    const { gl, parallelCompile } = this;
    const programs = names.map((name) => this.program(name));
    return !parallelCompile || programs.every((program) => gl.getProgramParameter(program, parallelCompile.COMPLETION_STATUS_KHR));
  }

  /**
   * @param {string} vertex
   * @param {string} fragment
   */
  compiled(vertex, fragment) {
    const { gl } = this;
    const program = gl.createProgram();
    if (!program) throw new GraphicsError("the graphics card was lost");
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(/** @type {number} */ (type));
      if (!shader) throw new GraphicsError("the graphics card was lost");
      gl.shaderSource(shader, /** @type {string} */ (source));
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    return program;
  }

  /**
   * Uses a program with the field's textures.
   * @param {WebGLProgram} program
   */
  use(program) {
    const { gl, field } = this;
    if (!this.locations.has(program)) this.checkLinked(program);
    gl.useProgram(program);
    Object.entries(this.textures).forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(this.at(program, name), unit);
    });
    gl.uniform3ui(this.at(program, "grid"), ...field.grid);
    gl.uniform3f(this.at(program, "baseCell"), ...this.cellSize());
    gl.uniform1f(this.at(program, "exactOffset"), field.exact.offset);
    gl.uniform1f(this.at(program, "blend"), field.blend);
  }

  /**
   * @param {WebGLProgram} program
   */
  checkLinked(program) {
    const { gl } = this;
    if (gl.getProgramParameter(program, gl.LINK_STATUS)) return;
    const logs = (gl.getAttachedShaders(program) ?? []).map((shader) => gl.getShaderInfoLog(shader));
    throw new GraphicsError(`the graphics card refuses a shader: ${logs.join(" ")} ${gl.getProgramInfoLog(program)}`);
  }

  /**
   * @returns {Vector}
   */
  cellSize() {
    return /** @type {Vector} */ (this.field.size.map((x, a) => x / this.field.grid[a]));
  }

  /**
   * Returns where a uniform of a program is.
   * @param {WebGLProgram} program
   * @param {string} name
   */
  at(program, name) {
    const known = this.locations.get(program) ?? new Map();
    this.locations.set(program, known);
    if (!known.has(name)) known.set(name, this.gl.getUniformLocation(program, name));
    return known.get(name) ?? null;
  }

  /**
   * Binds a texture to a unit after those of the field.
   * @param {WebGLProgram} program
   * @param {string} name
   * @param {number} number
   * @param {WebGLTexture} texture
   */
  bind(program, name, number, texture) {
    const { gl } = this;
    const unit = Object.keys(this.textures).length + number;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.uniform1i(this.at(program, name), unit);
  }

  /**
   * Samples a plane into the first texture of `buffers.hits`: cell, degree, depth and the bits of the value. The portions are rows of
   * pixels.
   * @param {Buffers} buffers
   * @param {Plane} plane
   * @param {number} width
   * @param {number} height
   * @returns {Job}
   */
  sliceJob(buffers, plane, width, height) {
    const { gl } = this;
    const hits = buffers.resize("hits", width, height);
    const { wholes, fractions } = buffers.setPositions(this.positions(plane, width, height));
    const draw = (/** @type {number} */ first, /** @type {number} */ count) => {
      hits.bind([gl.COLOR_ATTACHMENT0, gl.NONE]);
      const slicing = this.program("slicing");
      this.use(slicing);
      this.bind(slicing, "wholes", 0, wholes);
      this.bind(slicing, "fractions", 1, fractions);
      this.drawRows(first, count, width);
    };
    return { kind: "slice", programs: ["slicing"], hits, size: height, draw };
  }

  /**
   * Runs the current program for some rows of pixels.
   * @param {number} first
   * @param {number} count
   * @param {number} width
   */
  drawRows(first, count, width) {
    const { gl } = this;
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(0, first, width, count);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
  }

  /**
   * Draws a whole slice.
   * @param {Plane} plane
   * @param {number} width
   * @param {number} height
   */
  slice(plane, width, height) {
    return whole(this.sliceJob(this.buffers, plane, width, height));
  }

  /**
   * The positions of a slice's columns and rows in grid coordinates.
   * @param {Plane} plane
   * @param {number} width
   * @param {number} height
   */
  positions(plane, width, height) {
    const { gl, field } = this;
    const most = Math.max(width, height);
    const wholes = new Int32Array(8 * most);
    const fractions = new Uint32Array(8 * most);
    const set = (/** @type {number} */ at, /** @type {number} */ axis, /** @type {number} */ x) => {
      const integer = Math.floor(x);
      wholes[4 * at + axis] = integer;
      fractions[4 * at + axis] = Math.floor((x - integer) * 2 ** 32);
    };
    const still = /** @type {Vector} */ ([0, 0, 0]);
    const pointAt = (/** @type {Plane} */ moved, /** @type {number} */ x, /** @type {number} */ y) => gridPointOfPixel(field, moved, x, y, width, height);
    const middle = gridPoint(field, plane.origin);
    for (let axis = 0; axis < 3; ++axis) {
      // A coordinate that only columns or only rows change is rounded as in the program.
      const inRows = plane.right[axis] === 0;
      const isShared = !inRows && plane.up[axis] !== 0;
      for (let x = 0; x < width; ++x) set(x, axis, inRows ? 0 : pointAt({ ...plane, up: still }, x, 0)[axis]);
      for (let y = 0; y < height; ++y) {
        const here = inRows || isShared ? pointAt({ ...plane, right: still }, 0, y)[axis] : 0;
        set(most + y, axis, isShared ? here - middle[axis] : here);
      }
    }
    return {
      wholes: this.plainTexture(gl.RGBA32I, most, 2, gl.RGBA_INTEGER, gl.INT, wholes),
      fractions: this.plainTexture(gl.RGBA32UI, most, 2, gl.RGBA_INTEGER, gl.UNSIGNED_INT, fractions),
    };
  }

  /**
   * Traces a surface into the two textures of `buffers.hits`: cell; degree, depth and crack; the bits of the value and of the distance;
   * and the normal. The portions are blocks of pixels.
   * @param {Buffers} buffers
   * @param {Rays} rays
   * @param {number} width
   * @param {number} height
   * @param {number} offset
   * @param {Clip | null} clip
   * @returns {Job}
   */
  surfaceJob(buffers, rays, width, height, offset, clip) {
    const { gl, field } = this;
    const state = buffers.resize("state", width, height);
    const hits = buffers.resize("hits", width, height);
    const found = surfaceBlocks(field, this.bounds, rays, width, height, offset);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers.blocks);
    gl.bufferData(gl.ARRAY_BUFFER, found.blocks, gl.STREAM_DRAW);
    /** @type {(name: string, target: Target, from: Target, first: number, count: number) => void} */
    const pass = (name, target, from, first, count) => {
      const program = this.program(name);
      target.bind([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
      this.use(program);
      this.setRays(program, rays, width, height, offset, clip);
      gl.uniform1f(this.at(program, "startSide"), found.side);
      gl.uniform1i(this.at(program, "atTriangles"), offset === -field.exact.offset ? 1 : 0);
      gl.uniform1i(this.at(program, "resume"), steps > MOST_STEPS ? 1 : 0);
      this.bind(program, "stateIntegers", 0, from.integers);
      this.bind(program, "stateFloats", 1, from.floats);
      gl.bindVertexArray(buffers.blockArray);
      gl.drawArrays(gl.POINTS, first, count);
    };
    let latest = state;
    let steps = 0;
    const draw = (/** @type {number} */ first, /** @type {number} */ count) => {
      latest = state;
      steps = MOST_STEPS;
      pass("marching", state, hits, first, count); // the first march declares the textures of a state, but does not read them
      pass("hitting", hits, state, first, count);
    };
    const resume = (/** @type {number} */ first, /** @type {number} */ count) => {
      if (steps >= STEPS_IN_ALL || !this.isAnyUnderWay(buffers, latest, first, count)) return false;
      const next = latest === state ? buffers.targetOf("spare", width, height) : state;
      steps += MOST_STEPS;
      pass("marching", next, latest, first, count);
      pass("hitting", hits, next, first, count);
      latest = next;
      return true;
    };
    return { kind: "surface", programs: ["marching", "hitting", "asking"], hits, size: found.blocks.length / 3, draw, resume };
  }

  /**
   * Returns true if the march of any ray in these blocks has not ended.
   * @param {Buffers} buffers
   * @param {Target} state
   * @param {number} first
   * @param {number} count
   */
  isAnyUnderWay(buffers, state, first, count) {
    const { gl } = this;
    this.answer.bind([gl.COLOR_ATTACHMENT0]);
    gl.clearBufferfv(gl.COLOR, 0, new Float32Array(4));
    const asking = this.program("asking");
    this.use(asking);
    this.bind(asking, "stateIntegers", 0, state.integers);
    gl.bindVertexArray(buffers.blockArray);
    gl.drawArrays(gl.POINTS, first, count);
    const pixel = new Uint8Array(4);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return pixel[0] > 0;
  }

  /**
   * Draws a whole surface.
   * @param {Rays} rays
   * @param {number} width
   * @param {number} height
   * @param {number} offset
   * @param {Clip | null} clip
   */
  surface(rays, width, height, offset, clip = null) {
    return whole(this.surfaceJob(this.buffers, rays, width, height, offset, clip));
  }

  /**
   * Samples the sections of a surface's picture into the first texture of `buffers.section` (section.frag): with the plane that cuts
   * the surface open, and with another plane. The portions are rows of pixels.
   * @param {Buffers} buffers
   * @param {Rays} rays
   * @param {number} width
   * @param {number} height
   * @param {number} offset
   * @param {Clip | null} clip
   * @param {{point: Vector, normal: Vector} | null} plane
   * @returns {Job}
   */
  sectionJob(buffers, rays, width, height, offset, clip, plane) {
    const { gl, field } = this;
    const hits = buffers.resize("section", width, height);
    const cut = clip ? gridPlane(field, clipPoint(field, clip), axisVector(clip.axis)) : [0, 0, 0, 0];
    const shown = plane ? gridPlane(field, plane.point, plane.normal) : [0, 0, 0, 0];
    const draw = (/** @type {number} */ first, /** @type {number} */ count) => {
      hits.bind([gl.COLOR_ATTACHMENT0, gl.NONE]);
      const sectioning = this.program("sectioning");
      this.use(sectioning);
      this.setRays(sectioning, rays, width, height, offset, clip);
      gl.uniform4fv(this.at(sectioning, "planes"), [...cut, ...shown]);
      gl.uniform3f(this.at(sectioning, "nudge"), ...(clip ? scaled(axisVector(clip.axis), (isEyeAbove(rays, clip) ? -CLIP_NUDGE : CLIP_NUDGE) * field.grid[clip.axis]) : axisVector(-1)));
      this.drawRows(first, count, width);
    };
    return { kind: "section", programs: ["sectioning"], hits, size: height, draw };
  }

  /**
   * @param {WebGLProgram} program
   * @param {Rays} rays
   * @param {number} width
   * @param {number} height
   * @param {number} offset
   * @param {Clip | null} clip
   */
  setRays(program, rays, width, height, offset, clip) {
    const { gl, field } = this;
    const scale = /** @type {Vector} */ (field.grid.map((x, a) => x / field.size[a]));
    const set = (/** @type {string} */ name, /** @type {Vector} */ v) => gl.uniform3f(this.at(program, name), ...v);
    gl.uniform2i(this.at(program, "firstPixel"), 0, 0);
    gl.uniform2i(this.at(program, "size"), width, height);
    gl.uniform2i(this.at(program, "viewport"), width, height);
    set("eye", gridPoint(field, rays.eye));
    set("forward", rays.forward);
    set("right", rays.right);
    set("up", rays.up);
    set("scale", scale);
    gl.uniform2f(this.at(program, "pixelStep"), 1 / width, 1 / height);
    gl.uniform1f(this.at(program, "offset"), offset);
    gl.uniform1f(this.at(program, "diagonal"), diagonalOf(field));
    const [shownLo, shownHi] = shownBox(field, rays, clip);
    set("shownLo", shownLo);
    set("shownHi", shownHi);
    gl.uniform1i(this.at(program, "parallel"), rays.parallel ? 1 : 0);
    gl.uniform1i(this.at(program, "mostSteps"), MOST_STEPS);
    gl.uniform1i(this.at(program, "blendedSteps"), BLENDED_STEPS);
    gl.uniform1i(this.at(program, "mostRefinements"), MOST_REFINEMENTS);
  }
}

/** What a picture is drawn into. One picture can be shown while the next one is drawn into other buffers. */
export class Buffers {
  /**
   * @param {FieldRenderer} renderer
   */
  constructor(renderer) {
    const { gl } = renderer;
    this.renderer = renderer;
    /** @type {{state: Target | null, spare: Target | null, hits: Target | null, section: Target | null}} */
    this.targets = { state: null, spare: null, hits: null, section: null };
    /** @type {ColorTarget | null} */
    this.colors = null;
    /** @type {{wholes: WebGLTexture, fractions: WebGLTexture} | null} */
    this.positions = null;
    this.blockArray = gl.createVertexArray();
    this.blocks = gl.createBuffer();
    gl.bindVertexArray(this.blockArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.blocks);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
  }

  /**
   * Returns an empty target of this size.
   * @param {"state" | "hits" | "section"} name
   * @param {number} width
   * @param {number} height
   */
  resize(name, width, height) {
    const target = this.targetOf(name, width, height);
    target.clear();
    return target;
  }

  /**
   * Returns a target of this size. The target "spare" holds the state of rays besides "state", since no pass reads what it draws into.
   * @param {"state" | "spare" | "hits" | "section"} name
   * @param {number} width
   * @param {number} height
   */
  targetOf(name, width, height) {
    const before = this.targets[name];
    if (before?.width === width && before.height === height) return before;
    before?.remove();
    const target = new Target(this.renderer, width, height);
    this.targets[name] = target;
    return target;
  }

  /**
   * Returns the target for colours of this size.
   * @param {number} width
   * @param {number} height
   */
  resizeColors(width, height) {
    if (this.colors?.width === width && this.colors.height === height) return this.colors;
    this.colors?.remove();
    this.colors = new ColorTarget(this.renderer, width, height);
    return this.colors;
  }

  /**
   * Keeps the positions of a slice, in place of those before.
   * @param {{wholes: WebGLTexture, fractions: WebGLTexture}} positions
   */
  setPositions(positions) {
    const { gl } = this.renderer;
    if (this.positions) for (const texture of Object.values(this.positions)) gl.deleteTexture(texture);
    this.positions = positions;
    return positions;
  }
}

/** Textures of one size into which a pass draws. */
class Frame {
  /**
   * @param {FieldRenderer} renderer
   * @param {number} width
   * @param {number} height
   * @param {WebGLTexture[]} textures
   */
  constructor({ gl }, width, height, textures) {
    this.gl = gl;
    this.width = width;
    this.height = height;
    this.textures = textures;
    this.frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    textures.forEach((texture, n) => gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + n, gl.TEXTURE_2D, texture, 0));
  }

  /**
   * Makes the textures the target of the next pass.
   * @param {number[]} attachments  into which it draws
   */
  bind(attachments) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.viewport(0, 0, this.width, this.height);
    gl.drawBuffers(attachments);
  }

  remove() {
    this.gl.deleteFramebuffer(this.frame);
    for (const texture of this.textures) this.gl.deleteTexture(texture);
  }
}

/** A texture of colours. */
export class ColorTarget extends Frame {
  /**
   * @param {FieldRenderer} renderer
   * @param {number} width
   * @param {number} height
   */
  constructor(renderer, width, height) {
    const { gl } = renderer;
    super(renderer, width, height, [renderer.plainTexture(gl.RGBA8, width, height, gl.RGBA, gl.UNSIGNED_BYTE, null)]);
  }
}

/** Two textures: one of four integers for each pixel, one of four floats. */
export class Target extends Frame {
  /**
   * @param {FieldRenderer} renderer
   * @param {number} width
   * @param {number} height
   */
  constructor(renderer, width, height) {
    const { gl } = renderer;
    const integers = renderer.plainTexture(gl.RGBA32UI, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, null);
    const floats = renderer.plainTexture(gl.RGBA32F, width, height, gl.RGBA, gl.FLOAT, null);
    super(renderer, width, height, [integers, floats]);
    this.integers = integers;
    this.floats = floats;
  }

  clear() {
    const { gl } = this;
    this.bind([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
    gl.clearBufferuiv(gl.COLOR, 0, new Uint32Array([NO_CELL, 0, 0, 0]));
    gl.clearBufferfv(gl.COLOR, 1, new Float32Array(4));
  }

  /**
   * Returns the cell at a pixel, counted from the top left, its levels as the shader packs them, and the length of its ray up to there.
   * @param {number} x
   * @param {number} y
   */
  at(x, y) {
    const { gl } = this;
    const texel = new Uint32Array(4);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(x, y, 1, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, texel);
    return { cell: texel[0], levels: texel[1], distance: new Float32Array(texel.buffer)[3] };
  }

  /** Returns the integers, four for each pixel, from the top row down. */
  read() {
    const { gl } = this;
    const pixels = new Uint32Array(4 * this.width * this.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(0, 0, this.width, this.height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, pixels);
    return pixels;
  }
}
