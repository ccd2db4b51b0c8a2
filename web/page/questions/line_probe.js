// A field along a segment: the leaves that the segment crosses, and samples within each of them, as the program's `probe` has them
// (hpsdf/detail/line.h).

import { nodeAt } from "../field/leaves.js";
import { evaluateIn, gridPoint, query } from "../field/query.js";
import { add, dot, length, scaled, subtract } from "../field/vector.js";

/** @typedef {import("../field/field_file.js").Field} Field */
/** @typedef {import("../field/field_file.js").Vector} Vector */
/** @typedef {import("../field/leaves.js").OctreeNode} OctreeNode */
/** @typedef {import("../field/query.js").ValueAndGradient} ValueAndGradient */

/**
 * The part of a segment in one leaf, or a part outside of the domain. Parameters are 0 at the segment's start and 1 at its end.
 * @typedef {{leaf: OctreeNode | null, enter: number, leave: number}} Piece
 */

/**
 * @typedef {object} LineSample
 * @property {number} t  from 0 to 1
 * @property {number} piece  index of the piece
 * @property {Vector} point
 * @property {number} value
 * @property {Vector} gradient
 * @property {number} slope  component of the gradient along the line
 */

/**
 * Samples along a segment. Where two pieces meet, two samples of one t hold the limits from both sides.
 * @typedef {{from: Vector, to: Vector, length: number, pieces: Piece[], samples: LineSample[]}} Line
 */

const SHORTEST = 1e-12; // pieces that are a smaller part of the segment result from rounding
const FINEST = 20; // the greatest depth
const UNIT = 2 ** FINEST; // cells of that depth along the edge of a base cell

/**
 * One coordinate of the points of a segment, counted in cells of the greatest depth: start + t · speed.
 * @typedef {{start: number, speed: number, cells: number}} Axis
 */

/**
 * @param {Axis} axis
 * @param {number} face
 */
function parameterAt(axis, face) {
  return (face - axis.start) / axis.speed;
}

/**
 * @param {number} x
 * @param {number} least
 * @param {number} most
 */
function clamped(x, least, most) {
  return Math.min(Math.max(x, least), most);
}

/**
 * Returns the range of t within the domain, or null if the segment misses it.
 * @param {Axis[]} axes
 * @returns {[number, number] | null}
 */
function clippedToDomain(axes) {
  let first = 0, last = 1;
  for (const axis of axes) {
    if (axis.speed === 0) {
      if (axis.start < 0 || axis.start > axis.cells) return null;
      continue;
    }
    const ends = [parameterAt(axis, 0), parameterAt(axis, axis.cells)];
    first = Math.max(first, Math.min(...ends));
    last = Math.min(last, Math.max(...ends));
  }
  return last - first > SHORTEST ? [first, last] : null;
}

/**
 * Divides the part of a segment in the domain into one piece for each leaf. Each step goes on along at least one axis and back along
 * none, whatever the rounding.
 * @param {Field} field
 * @param {Axis[]} axes
 * @param {[number, number]} range
 */
function walkedPieces(field, axes, [first, last]) {
  /** @type {Piece[]} */
  const pieces = [];
  const cell = /** @type {Vector} */ (axes.map(({ start, speed, cells }) => clamped(Math.floor(start + first * speed), 0, cells - 1)));
  for (let t = first; ; ) {
    const leaf = nodeAt(field, cell, FINEST);
    const width = 2 ** (FINEST - leaf.depth);
    const corner = leaf.cell.map((index) => index * width);
    const exits = axes.map((axis, a) => (axis.speed === 0 ? Infinity : parameterAt(axis, corner[a] + (axis.speed > 0 ? width : 0))));
    const next = Math.min(...exits);
    const leave = Math.min(next, last);
    if (leave - t > SHORTEST) {
      pieces.push({ leaf, enter: t, leave });
      t = leave;
    }
    if (next >= last) return pieces;
    for (let a = 0; a < 3; ++a) {
      const { start, speed, cells } = axes[a];
      if (exits[a] === next) cell[a] = speed > 0 ? corner[a] + width : corner[a] - 1;
      else cell[a] = clamped(Math.floor(start + next * speed), corner[a], corner[a] + width - 1);
      if (cell[a] < 0 || cell[a] >= cells) return pieces;
    }
  }
}

/**
 * Cuts a segment into pieces at the faces of leaves. Pieces are in the order of t, and each begins where the one before it ends.
 * @param {Field} field
 * @param {Vector} from
 * @param {Vector} to
 * @returns {Piece[]}
 */
export function piecesAlong(field, from, to) {
  const start = gridPoint(field, from);
  const axes = gridPoint(field, to).map((end, a) => ({ start: start[a] * UNIT, speed: end * UNIT - start[a] * UNIT, cells: field.grid[a] * UNIT }));
  const range = clippedToDomain(axes);
  const pieces = range ? walkedPieces(field, axes, range) : [];
  if (!range || pieces.length === 0) return [{ leaf: null, enter: 0, leave: 1 }];
  const [first, last] = range;
  pieces[pieces.length - 1].leave = 1 - last > SHORTEST ? last : 1;
  if (first > SHORTEST) pieces.unshift({ leaf: null, enter: 0, leave: first });
  else pieces[0].enter = 0;
  if (1 - last > SHORTEST) pieces.push({ leaf: null, enter: last, leave: 1 });
  return pieces;
}

/**
 * Returns the field's continuation outside of the domain: the value at the domain's closest point plus the distance from there.
 * @param {Field} field
 * @param {Vector} point
 * @returns {ValueAndGradient}
 */
function continued(field, point) {
  const closest = /** @type {Vector} */ (point.map((x, a) => clamped(x, field.lower[a], field.upper[a])));
  const offset = subtract(point, closest);
  const distance = Math.hypot(...offset);
  const { value, gradient } = /** @type {ValueAndGradient} */ (query(field, closest));
  if (distance === 0) return { value, gradient };
  const along = /** @type {Vector} */ (gradient.map((g, a) => (offset[a] !== 0 ? 0 : g)));
  return { value: value + distance, gradient: add(along, scaled(offset, 1 / distance)) };
}

/**
 * @param {Vector} from
 * @param {Vector} to
 * @param {number} t
 */
export function pointBetween(from, to, t) {
  return t === 1 ? to : add(from, scaled(subtract(to, from), t));
}

/**
 * Evaluates a piece of the segment at t. Outside of the domain, the gradient is that of a place just within the piece, because on the
 * boundary the leaf has another one.
 * @param {Field} field
 * @param {Vector} from
 * @param {Vector} to
 * @param {Piece} piece
 * @param {number} t
 * @returns {ValueAndGradient}
 */
function evaluatePiece(field, from, to, piece, t) {
  const point = pointBetween(from, to, t);
  if (piece.leaf) return evaluateIn(field, piece.leaf, gridPoint(field, point));
  const margin = 1e-9 * (piece.leave - piece.enter);
  const within = pointBetween(from, to, clamped(t, piece.enter + margin, piece.leave - margin));
  return { value: continued(field, point).value, gradient: continued(field, within).gradient };
}

/**
 * Samples a field at `count` ≥ 2 evenly spaced points of a segment, both ends included, and at both ends of each piece.
 * @param {Field} field
 * @param {Vector} from
 * @param {Vector} to  another point than `from`
 * @param {number} count
 * @returns {Line}
 */
export function sampleLine(field, from, to, count) {
  const pieces = piecesAlong(field, from, to);
  const along = subtract(to, from);
  const whole = length(along);
  /** @type {LineSample[]} */
  const samples = [];
  let next = 0; // number of the next evenly spaced sample
  pieces.forEach((piece, n) => {
    const sample = (/** @type {number} */ t) => {
      const { value, gradient } = evaluatePiece(field, from, to, piece, t);
      samples.push({ t, piece: n, point: pointBetween(from, to, t), value, gradient, slope: dot(gradient, along) / whole });
    };
    sample(piece.enter);
    while (next < count && next / (count - 1) <= piece.enter) ++next;
    for (; next < count && next / (count - 1) < piece.leave; ++next) sample(next / (count - 1));
    sample(piece.leave);
  });
  return { from, to, length: whole, pieces, samples };
}

/**
 * Returns the line of a script by which the program writes the same samples.
 * @param {Vector} from
 * @param {Vector} to
 */
export function scriptOfProbe(from, to) {
  return `probe from=${from.join(",")} to=${to.join(",")} output=line.png`;
}
