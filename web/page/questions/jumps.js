// Jumps of a field on the faces between neighbouring leaves, as the program measures them (hpsdf/jumps.h).

import { degreeOf, isExact, isLeaf } from "../field/field_file.js";
import { leavesInOrder, nodeAt } from "../field/leaves.js";
import { evaluateIn, gridPoint, leafAt, query, tabulateLegendre, worldPoint } from "../field/query.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */
/** @typedef {import("../field/leaves.js").OctreeNode} OctreeNode */

/** @typedef {"value" | "gradient"} JumpKind */

/**
 * The whole face of the leaf `small` at the lower (step −1) or upper (step 1) end of an axis. The leaf `large` lies on the other side.
 * @typedef {{small: OctreeNode, large: OctreeNode, axis: number, step: number}} Face
 */

/**
 * The face that two leaves share, with its jumps.
 * @typedef {object} Interface
 * @property {[number, number]} cells  the nodes on the lower and on the upper side
 * @property {number} axis  normal to the face
 * @property {number} depth  of the smaller leaf
 * @property {Vector} worst  the point of the face where the value jumps most, in the field's units
 * @property {number} value  greatest jump of the value
 * @property {number} gradient  greatest length of the jump of the gradient
 * @property {boolean} isAtSurface
 * @property {boolean} isTorn
 */

const ROW_OF_DEGREES = 31; // degrees 0 to 30
const MOST_SAMPLES = 33; // along one axis of a face: a Gauss rule for degree 30, and both ends
const LEAST_GAP = 1e-7; // a jump that is smaller tears nothing: it may be rounding; in sizes of the domain
const EXACT_SAMPLE_DEGREE = 6; // distances to triangles are smooth but for a few bends

/**
 * Returns the points of the Gauss-Legendre rule with n points in [−1, 1], in increasing order.
 * @param {number} n
 */
function gaussPoints(n) {
  const values = new Float64Array(n + 1);
  const derivatives = new Float64Array(n + 1);
  return Array.from({ length: n }, (_, i) => {
    if (2 * i + 1 === n) return 0;
    let x = -Math.cos((Math.PI * (i + 0.75)) / (n + 0.5)); // Tricomi's estimate, from which Newton's method needs a few steps
    for (let step = 0; step < 8; ++step) {
      tabulateLegendre(x, n, values, derivatives, 0);
      x -= values[n] / derivatives[n];
    }
    return x;
  });
}

/**
 * @param {Field} field
 * @param {number} depth
 * @returns {Vector}
 */
function cellSize(field, depth) {
  return /** @type {Vector} */ (field.size.map((x, a) => x / field.grid[a] / 2 ** depth));
}

/** Values and gradients of one leaf at the samples of a face, of which those along the second axis follow each other. */
class FaceTrace {
  constructor() {
    const list = () => new Float64Array(MOST_SAMPLES ** 2);
    this.values = list();
    this.derivatives = [list(), list(), list()]; // along x, y and z, in the field's units
    this.basis = [0, 1].map(() => new Float64Array(MOST_SAMPLES * ROW_OF_DEGREES)); // a row for each sample along an axis
    this.basisSlopes = [0, 1].map(() => new Float64Array(MOST_SAMPLES * ROW_OF_DEGREES));
    const row = () => new Float64Array(ROW_OF_DEGREES);
    this.across = row();
    this.acrossSlopes = row();
    this.plane = new Float64Array(ROW_OF_DEGREES ** 2); // coefficients of the polynomial on the plane of the face
    this.planeSlopes = new Float64Array(ROW_OF_DEGREES ** 2); // of its derivative across the plane
    this.line = row(); // coefficients on a line in the plane, and of its derivatives along the second axis and across
    this.lineAlong = row();
    this.lineAcross = row();
  }

  /**
   * Evaluates the polynomial of a leaf on a whole face of `small`, which is the leaf or a smaller neighbour.
   * @param {Field} field
   * @param {OctreeNode} leaf
   * @param {OctreeNode} small
   * @param {number} axis
   * @param {number} t  the leaf's local coordinate of the face
   * @param {number[]} samples
   */
  evaluate(field, leaf, small, axis, t, samples) {
    const degree = degreeOf(field, leaf.node);
    const levels = small.depth - leaf.depth;
    const scale = 2 ** -levels;
    for (let side = 0; side < 2; ++side) {
      const along = (axis + 1 + side) % 3;
      const offset = small.cell[along] - leaf.cell[along] * 2 ** levels;
      for (let s = 0; s < samples.length; ++s) {
        const u = levels > 0 ? (2 * offset + samples[s] + 1) * scale - 1 : samples[s];
        tabulateLegendre(u, degree, this.basis[side], this.basisSlopes[side], s * ROW_OF_DEGREES);
      }
    }
    this.restrictToPlane(field, leaf.node, degree, axis, t);
    const toWorld = cellSize(field, leaf.depth).map((x) => 2 / x);
    for (let s1 = 0; s1 < samples.length; ++s1) {
      this.restrictToLine(degree, s1);
      for (let s0 = 0; s0 < samples.length; ++s0) this.evaluatePoint(degree, axis, s0, s0 * samples.length + s1, toWorld);
    }
  }

  /**
   * @param {Field} field
   * @param {number} leaf
   * @param {number} degree
   * @param {number} axis
   * @param {number} t
   */
  restrictToPlane(field, leaf, degree, axis, t) {
    const { across, acrossSlopes, plane, planeSlopes } = this;
    tabulateLegendre(t, degree, across, acrossSlopes, 0);
    const strides = [0, 0, 0];
    strides[(axis + 1) % 3] = ROW_OF_DEGREES;
    strides[(axis + 2) % 3] = 1;
    for (let i = 0; i <= degree; ++i) {
      plane.fill(0, i * ROW_OF_DEGREES, i * ROW_OF_DEGREES + degree + 1);
      planeSlopes.fill(0, i * ROW_OF_DEGREES, i * ROW_OF_DEGREES + degree + 1);
    }
    let index = field.first[leaf];
    for (let i = 0; i <= degree; ++i)
      for (let j = 0; j <= degree - i; ++j)
        for (let k = 0; k <= degree - i - j; ++k) {
          const c = field.coefficients[index++];
          const at = i * strides[0] + j * strides[1] + k * strides[2];
          const n = axis === 0 ? i : axis === 1 ? j : k;
          plane[at] += c * across[n];
          planeSlopes[at] += c * acrossSlopes[n];
        }
  }

  /**
   * @param {number} degree
   * @param {number} s1  sample along the second axis in the plane
   */
  restrictToLine(degree, s1) {
    const { plane, planeSlopes } = this;
    const basis = this.basis[1], slopes = this.basisSlopes[1];
    const row = s1 * ROW_OF_DEGREES;
    for (let i = 0; i <= degree; ++i) {
      let value = 0, along = 0, across = 0;
      for (let j = 0; j <= degree - i; ++j) {
        const c = plane[i * ROW_OF_DEGREES + j];
        value += c * basis[row + j];
        along += c * slopes[row + j];
        across += planeSlopes[i * ROW_OF_DEGREES + j] * basis[row + j];
      }
      this.line[i] = value;
      this.lineAlong[i] = along;
      this.lineAcross[i] = across;
    }
  }

  /**
   * @param {number} degree
   * @param {number} axis
   * @param {number} s0  sample along the first axis in the plane
   * @param {number} at  place of the result
   * @param {number[]} toWorld
   */
  evaluatePoint(degree, axis, s0, at, toWorld) {
    const { line, lineAlong, lineAcross } = this;
    const basis = this.basis[0], slopes = this.basisSlopes[0];
    const row = s0 * ROW_OF_DEGREES;
    let value = 0, first = 0, second = 0, across = 0;
    for (let i = 0; i <= degree; ++i) {
      const b = basis[row + i];
      value += b * line[i];
      first += slopes[row + i] * line[i];
      second += b * lineAlong[i];
      across += b * lineAcross[i];
    }
    const next = (axis + 1) % 3, last = (axis + 2) % 3;
    this.values[at] = value;
    this.derivatives[axis][at] = across * toWorld[axis];
    this.derivatives[next][at] = first * toWorld[next];
    this.derivatives[last][at] = second * toWorld[last];
  }
}

/** Measures the jumps on faces, one after the other. */
export class FaceMeter {
  /**
   * @param {Field} field
   */
  constructor(field) {
    this.field = field;
    this.traces = [new FaceTrace(), new FaceTrace()]; // of the leaves on the lower and on the upper side
    /** @type {number[][]} */
    this.samplesOfDegree = [];
    this.value = 0; // greatest jumps on the face that was measured last
    this.gradient = 0;
    this.worst = /** @type {Vector} */ ([0, 0, 0]); // where its value jumps most
    this.isTorn = false; // whether the field has different signs on the two sides there
  }

  /**
   * @param {number} leaf
   */
  sampleDegree(leaf) {
    return isExact(this.field, leaf) ? EXACT_SAMPLE_DEGREE : degreeOf(this.field, leaf);
  }

  /**
   * Returns the coordinates of samples for polynomials of a degree: those of a Gauss rule, and both ends.
   * @param {number} degree
   */
  samples(degree) {
    return (this.samplesOfDegree[degree] ??= [-1, ...gaussPoints(degree + 1), 1]);
  }

  /**
   * Measures a face. It yields between portions, because exact leaves take long.
   * @param {Face} face
   * @returns {Generator<void, void>}
   */
  *measure(face) {
    const { small, large, axis, step } = face;
    const samples = this.samples(Math.max(this.sampleDegree(small.node), this.sampleDegree(large.node)));
    const sides = step > 0 ? [small, large] : [large, small];
    for (let side = 0; side < 2; ++side) {
      if (this.field.blend > 0 || isExact(this.field, sides[side].node)) yield* this.tracePoints(this.traces[side], sides[side], face, samples);
      else this.traces[side].evaluate(this.field, sides[side], small, axis, side === 0 ? 1 : -1, samples);
    }
    this.compare(face, samples);
  }

  /**
   * Evaluates the field point by point. The results are the limits from within `leaf`.
   * @param {FaceTrace} trace
   * @param {OctreeNode} leaf
   * @param {Face} face
   * @param {number[]} samples
   * @returns {Generator<void, void>}
   */
  *tracePoints(trace, leaf, face, samples) {
    for (let at = 0; at < samples.length ** 2; ++at) {
      const { value, gradient } = evaluateIn(this.field, leaf, gridPointOf(face, samples, at));
      trace.values[at] = value;
      for (let a = 0; a < 3; ++a) trace.derivatives[a][at] = gradient[a];
      if ((at + 1) % samples.length === 0) yield;
    }
  }

  /**
   * @param {Face} face
   * @param {number[]} samples
   */
  compare(face, samples) {
    const [lower, upper] = this.traces;
    const [x, y, z] = lower.derivatives, [x1, y1, z1] = upper.derivatives;
    let value = 0, squared = 0, worst = -1;
    for (let at = 0; at < samples.length ** 2; ++at) {
      const jump = Math.abs(upper.values[at] - lower.values[at]);
      const dx = x1[at] - x[at], dy = y1[at] - y[at], dz = z1[at] - z[at];
      squared = Math.max(squared, dx * dx + dy * dy + dz * dz);
      if (jump <= value) continue;
      value = jump;
      worst = at;
    }
    this.value = value;
    this.isTorn = worst >= 0 && lower.values[worst] * upper.values[worst] < 0;
    this.gradient = Math.sqrt(squared);
    this.worst = worldPoint(this.field, worst < 0 ? centreOfFace(face) : gridPointOf(face, samples, worst));
  }

  /**
   * Returns the jumps on the face of a point's leaf that is nearest to the point, or null where there is no such face.
   * @param {Vector} point
   * @returns {{value: number, gradient: number} | null}
   */
  jumpsNear(point) {
    const face = nearestFace(this.field, point);
    if (!face) return null;
    for (const _ of this.measure(face));
    return { value: this.value, gradient: this.gradient };
  }
}

/**
 * @param {Face} face
 * @param {Vector} local  coordinates in [−1, 1] in the smaller leaf
 * @returns {Vector}
 */
function gridPointIn({ small }, local) {
  return /** @type {Vector} */ (local.map((u, a) => (small.cell[a] + (u + 1) / 2) / 2 ** small.depth));
}

/**
 * Returns the grid coordinates of a sample on a face.
 * @param {Face} face
 * @param {number[]} samples
 * @param {number} at
 */
function gridPointOf(face, samples, at) {
  /** @type {Vector} */
  const local = [face.step, face.step, face.step];
  local[(face.axis + 1) % 3] = samples[Math.floor(at / samples.length)];
  local[(face.axis + 2) % 3] = samples[at % samples.length];
  return gridPointIn(face, local);
}

/**
 * @param {Face} face
 */
function centreOfFace(face) {
  /** @type {Vector} */
  const local = [0, 0, 0];
  local[face.axis] = face.step;
  return gridPointIn(face, local);
}

/**
 * Returns the node beside a leaf, as large as the leaf or larger, or null at the domain's boundary.
 * @param {Field} field
 * @param {OctreeNode} leaf
 * @param {number} axis
 * @param {number} step
 */
function nodeBeside(field, { depth, cell }, axis, step) {
  /** @type {Vector} */
  const beside = [...cell];
  beside[axis] += step;
  return beside[axis] < 0 || beside[axis] >= field.grid[axis] * 2 ** depth ? null : nodeAt(field, beside, depth);
}

/**
 * Gives the faces of a leaf towards larger leaves, and its upper faces towards leaves of equal size. All leaves together give each
 * face between two leaves once.
 * @param {Field} field
 * @param {OctreeNode} small
 * @returns {Face[]}
 */
function facesOf(field, small) {
  /** @type {Face[]} */
  const faces = [];
  for (let axis = 0; axis < 3; ++axis)
    for (const step of [-1, 1]) {
      const large = nodeBeside(field, small, axis, step);
      if (large && isLeaf(field, large.node) && (large.depth < small.depth || step > 0)) faces.push({ small, large, axis, step });
    }
  return faces;
}

/**
 * Returns the face between a point's leaf and another leaf that is nearest to the point, or null outside of the domain and in a field
 * of one leaf.
 * @param {Field} field
 * @param {Vector} point
 * @returns {Face | null}
 */
function nearestFace(field, point) {
  const grid = gridPoint(field, point);
  const leaf = leafAt(field, grid);
  if (!leaf) return null;
  const size = cellSize(field, leaf.depth);
  let least = Infinity;
  let nearest = null;
  for (let axis = 0; axis < 3; ++axis)
    for (const step of [-1, 1]) {
      const distance = (1 - step * leaf.local[axis]) * size[axis];
      const other = distance < least && leafBeside(field, leaf, axis, step, grid);
      if (!other) continue;
      least = distance;
      const isOtherSmall = other.depth > leaf.depth || (other.depth === leaf.depth && step < 0);
      nearest = isOtherSmall ? { small: other, large: leaf, axis, step: -step } : { small: leaf, large: other, axis, step };
    }
  return nearest;
}

/**
 * Returns the leaf that touches a leaf's face where a point of the leaf is projected on it, or null at the domain's boundary.
 * @param {Field} field
 * @param {OctreeNode} leaf
 * @param {number} axis
 * @param {number} step
 * @param {Vector} grid  grid coordinates of the point
 */
function leafBeside(field, leaf, axis, step, grid) {
  const beside = nodeBeside(field, leaf, axis, step);
  if (!beside || isLeaf(field, beside.node)) return beside;
  const depth = 20;
  const cell = /** @type {Vector} */ (grid.map((x, a) => Math.min(Math.floor(x * 2 ** depth), field.grid[a] * 2 ** depth - 1)));
  cell[axis] = (leaf.cell[axis] + (step > 0 ? 1 : 0)) * 2 ** (depth - leaf.depth) - (step > 0 ? 0 : 1);
  return nodeAt(field, cell, depth);
}

/** The jumps on all faces between leaves, which are measured in portions. The order is that of the program. */
export class Jumps {
  /**
   * @param {Field} field
   */
  constructor(field) {
    this.field = field;
    this.share = 0; // done so far, from 0 to 1
    /** @type {Record<JumpKind, number[]>} */
    this.jumps = { value: [], gradient: [] };
    // Plain lists of numbers, because a million small arrays would keep the garbage collector busy.
    /** @type {number[]} */
    this.cells = []; // two for each interface
    /** @type {number[]} */
    this.worstPoints = []; // three coordinates for each
    /** @type {number[]} */
    this.axes = [];
    /** @type {number[]} */
    this.depths = [];
    /** @type {number[]} */
    this.values = []; // |f| where it jumps most
    /** @type {boolean[]} */
    this.torn = []; // whether f has different signs on the two sides there
    /** For each node, the greatest jump on the faces of a leaf; 0 for internal nodes. */
    this.ofCells = { value: new Float32Array(field.low.length), gradient: new Float32Array(field.low.length) };
    this.depthOfNode = new Uint8Array(field.low.length);
    this.work = this.measureAll();
  }

  get count() {
    return this.axes.length;
  }

  /**
   * Measures for about this long. Returns whether all is done.
   * @param {number} milliseconds
   */
  run(milliseconds) {
    const end = performance.now() + milliseconds;
    while (this.share < 1 && performance.now() < end) if (this.work.next().done) this.share = 1;
    return this.share === 1;
  }

  /**
   * @returns {Generator<void, void>}
   */
  *measureAll() {
    const meter = new FaceMeter(this.field);
    let total = 0, done = 0;
    for (let n = 0; n < this.field.low.length; ++n) total += isLeaf(this.field, n) ? 1 : 0;
    for (const leaf of leavesInOrder(this.field)) {
      this.depthOfNode[leaf.node] = leaf.depth;
      for (const face of facesOf(this.field, leaf)) {
        yield* meter.measure(face);
        this.append(face, meter);
        yield;
      }
      this.share = ++done / (total + 1);
    }
  }

  /**
   * @param {Face} face
   * @param {FaceMeter} meter
   */
  append({ small, large, axis, step }, meter) {
    const { value, gradient, worst } = meter;
    if (step > 0) this.cells.push(small.node, large.node);
    else this.cells.push(large.node, small.node);
    this.axes.push(axis);
    this.depths.push(small.depth);
    this.worstPoints.push(...worst);
    this.jumps.value.push(value);
    this.jumps.gradient.push(gradient);
    this.torn.push(meter.isTorn && value >= LEAST_GAP * this.field.size[axis]);
    this.values.push(Math.abs(query(this.field, worst)?.value ?? Infinity));
    for (const { node } of [small, large]) {
      this.ofCells.value[node] = Math.max(this.ofCells.value[node], value);
      this.ofCells.gradient[node] = Math.max(this.ofCells.gradient[node], gradient);
    }
  }

  /**
   * @param {number} n
   * @returns {Interface}
   */
  at(n) {
    const value = this.jumps.value[n];
    const [lower, upper] = this.cells.slice(2 * n, 2 * n + 2);
    const worst = /** @type {Vector} */ (this.worstPoints.slice(3 * n, 3 * n + 3));
    return {
      cells: [lower, upper], axis: this.axes[n], depth: this.depths[n], worst, value, gradient: this.jumps.gradient[n],
      isAtSurface: this.isAtSurface(n), isTorn: this.torn[n],
    };
  }

  /**
   * Returns whether the field at the greatest jump is at most a tenth of the edge of the smaller cell, or whether the surface is torn there.
   * @param {number} n
   */
  isAtSurface(n) {
    const edge = this.field.size[0] / this.field.grid[0] / 2 ** this.depths[n];
    return this.values[n] <= 0.1 * edge || this.torn[n];
  }

  /**
   * Returns the numbers of at most `count` interfaces with the greatest jumps, the greatest first. Equal ones keep their order.
   * @param {JumpKind} kind
   * @param {boolean} atSurface  only those at the surface
   * @param {number} count
   */
  worst(kind, atSurface, count) {
    const jumps = this.jumps[kind];
    /** @type {number[]} */
    const kept = [];
    for (let n = 0; n < jumps.length; ++n) {
      if (kept.length === count && !(jumps[n] > jumps[kept[count - 1]])) continue;
      if (atSurface && !this.isAtSurface(n)) continue;
      let at = kept.length;
      while (at > 0 && jumps[kept[at - 1]] < jumps[n]) --at;
      kept.splice(at, 0, n);
      if (kept.length > count) kept.pop();
    }
    return kept;
  }
}
