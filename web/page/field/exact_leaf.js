// The distance to the triangles of an exact leaf, in double precision.

import { add, cross, dot, length, normalized, scaled, subtract } from "./vector.js";

/** @typedef {import("./field_file.js").Field} Field */
/** @typedef {import("./field_file.js").ExactTriangles} ExactTriangles */
/** @typedef {import("./field_file.js").Vector} Vector */

const LAST_RUN = 0x80000000;
const HAS_REFERENCE = 0x80000000;

/** How an exact leaf finds the sign of its distance. */
export const SIGN_BY = { pseudonormal: 0, positive: 1, negative: 2, winding: 3 };

/**
 * @param {Field} field
 * @param {number} leaf
 */
export function signRule(field, leaf) {
  return (field.high[leaf] >>> 16) & 3;
}

/**
 * Calls `visit` with the index of each triangle of a leaf's list and its place in the list. Returns the index of the word behind the
 * list's runs.
 * @param {Field} field
 * @param {number} leaf
 * @param {(triangle: number, place: number) => void} visit
 */
export function forEachTriangle(field, leaf, visit) {
  const { lists } = field.exact;
  const count = lists[field.low[leaf]] & ~HAS_REFERENCE;
  let at = field.low[leaf] + 1 + ((count + 3) >> 2);
  for (let place = 0; ; ) {
    const run = lists[at++];
    const first = run & 0x7ffffff;
    const last = first + ((run >>> 27) & 15);
    for (let triangle = first; triangle <= last; ++triangle) visit(triangle, place++);
    if (run & LAST_RUN) return at;
  }
}

/**
 * @param {ExactTriangles} exact
 * @param {number} vertex
 * @returns {Vector}
 */
function vertexAt({ vertices }, vertex) {
  return [vertices[3 * vertex], vertices[3 * vertex + 1], vertices[3 * vertex + 2]];
}

/**
 * @param {ExactTriangles} exact
 * @param {number} triangle
 * @returns {[Vector, Vector, Vector]}
 */
export function cornersOf(exact, triangle) {
  const [a, b, c] = exact.triangles.subarray(3 * triangle, 3 * triangle + 3);
  return [vertexAt(exact, a), vertexAt(exact, b), vertexAt(exact, c)];
}

/**
 * The nearest face, edge or vertex of a list of triangles.
 * @typedef {object} Feature
 * @property {number} squared  squared distance
 * @property {Vector} difference  from the closest point to the query point
 * @property {number[]} vertices  of an edge two, of a vertex one, of a face none
 * @property {Vector} normal  of a face, not normalised
 * @property {number} height  of a face: signed distance from its plane
 */

/**
 * Returns the nearest feature of the triangles that count in one octant of a leaf.
 * @param {Field} field
 * @param {number} leaf
 * @param {number} octant
 * @param {Vector} x
 * @returns {Feature}
 */
function nearestFeature(field, leaf, octant, x) {
  const { exact } = field;
  const octants = new Uint8Array(exact.lists.buffer, exact.lists.byteOffset + 4 * (field.low[leaf] + 1));
  /** @type {Feature} */
  let best = { squared: Infinity, difference: [0, 0, 0], vertices: [], normal: [0, 0, 0], height: 0 };
  /**
   * @param {Vector} difference
   * @param {number[]} vertices
   */
  const tryPoint = (difference, vertices) => {
    const squared = dot(difference, difference);
    if (squared < best.squared) best = { squared, difference, vertices, normal: [0, 0, 0], height: 0 };
  };
  /**
   * @param {number} one
   * @param {number} other
   */
  const trySide = (one, other) => {
    // The ends are ordered by index, so that the triangles at an edge give the same result.
    const [from, to] = one < other ? [one, other] : [other, one];
    const start = vertexAt(exact, from);
    const along = subtract(vertexAt(exact, to), start);
    const difference = subtract(x, start);
    const t = dot(difference, along);
    const squaredLength = dot(along, along);
    if (t <= 0) tryPoint(difference, [from]);
    else if (t >= squaredLength) tryPoint(subtract(x, vertexAt(exact, to)), [to]);
    else tryPoint(subtract(difference, scaled(along, t / squaredLength)), [from, to]);
  };
  forEachTriangle(field, leaf, (triangle, place) => {
    if (((octants[place] >> octant) & 1) === 0) return;
    const corners = cornersOf(exact, triangle);
    const normal = cross(subtract(corners[1], corners[0]), subtract(corners[2], corners[0]));
    const squaredNormal = dot(normal, normal);
    let inside = squaredNormal > 0;
    for (let k = 0; k < 3; ++k) {
      const next = (k + 1) % 3;
      const side = subtract(corners[next], corners[k]);
      if (squaredNormal > 0 && dot(normal, cross(side, subtract(x, corners[k]))) > 0) continue;
      inside = false;
      trySide(exact.triangles[3 * triangle + k], exact.triangles[3 * triangle + next]);
    }
    if (!inside) return;
    const along = dot(subtract(x, corners[0]), normal);
    const squared = (along * along) / squaredNormal;
    if (squared >= best.squared) return;
    best = { squared, difference: scaled(normal, along / squaredNormal), vertices: [], normal, height: along / Math.sqrt(squaredNormal) };
  });
  return best;
}

/**
 * Returns the pseudonormal of a feature (Bærentzen and Aanæs 2005), not normalised.
 * @param {Field} field
 * @param {number} leaf
 * @param {Feature} feature
 * @returns {Vector}
 */
function pseudonormal(field, leaf, feature) {
  if (feature.vertices.length === 0) return feature.normal;
  const { exact } = field;
  /** @type {Vector} */
  let sum = [0, 0, 0];
  forEachTriangle(field, leaf, (triangle) => {
    const corners = Array.from(exact.triangles.subarray(3 * triangle, 3 * triangle + 3));
    if (!feature.vertices.every((vertex) => corners.includes(vertex))) return;
    const at = corners.indexOf(feature.vertices[0]);
    const positions = cornersOf(exact, triangle);
    const next = subtract(positions[(at + 1) % 3], positions[at]);
    const previous = subtract(positions[(at + 2) % 3], positions[at]);
    const normal = cross(next, previous);
    const size = length(normal);
    if (!(size > 0)) return;
    const weight = feature.vertices.length === 1 ? Math.atan2(size, dot(next, previous)) / size : 1 / size;
    sum = add(sum, scaled(normal, weight));
  });
  return sum;
}

/**
 * Returns the winding number at a point, from the reference point of the leaf's list.
 * @param {Field} field
 * @param {number} leaf
 * @param {Vector} x
 */
function windingAt(field, leaf, x) {
  const { exact } = field;
  const { lists } = exact;
  let firstTriangle = -1;
  const words = forEachTriangle(field, leaf, (triangle) => {
    if (firstTriangle < 0) firstTriangle = triangle;
  });
  const bits = new DataView(lists.buffer, lists.byteOffset + 4 * words, 16);
  const offset = /** @type {Vector} */ ([0, 4, 8].map((byte) => bits.getFloat32(byte, true)));
  const reference = add(cornersOf(exact, firstTriangle)[0], offset);
  let winding = bits.getInt32(12, true);
  forEachTriangle(field, leaf, (triangle) => {
    winding += crossing(cornersOf(exact, triangle), reference, x);
  });
  return winding;
}

/**
 * Six times the volume of a tetrahedron.
 * @param {Vector} a
 * @param {Vector} b
 * @param {Vector} c
 * @param {Vector} d
 */
function volume(a, b, c, d) {
  return dot(subtract(a, d), cross(subtract(b, d), subtract(c, d)));
}

/**
 * Returns 1 where the segment from p to q passes a triangle from its outer to its inner side, −1 the other way round, else 0.
 * @param {[Vector, Vector, Vector]} triangle
 * @param {Vector} p
 * @param {Vector} q
 */
function crossing([a, b, c], p, q) {
  const before = volume(a, b, c, p) < 0; // p is on the side to which the normal points
  const after = volume(a, b, c, q) < 0;
  if (before === after) return 0;
  const sides = [volume(p, q, a, b) > 0, volume(p, q, b, c) > 0, volume(p, q, c, a) > 0];
  if (sides[0] !== sides[1] || sides[1] !== sides[2]) return 0;
  return before ? 1 : -1;
}

/**
 * Returns the signed distance of a point of an exact leaf, with its gradient.
 * @param {Field} field
 * @param {number} leaf
 * @param {Vector} local  the point in the leaf's local coordinates
 * @param {Vector} x  the point in the field's units
 * @returns {{value: number, gradient: Vector}}
 */
export function evaluateExact(field, leaf, local, x) {
  const octant = local.reduce((bits, u, axis) => bits | (u >= 0 ? 1 << axis : 0), 0);
  const nearest = nearestFeature(field, leaf, octant, x);
  const distance = Math.sqrt(nearest.squared);
  const isFace = nearest.vertices.length === 0;
  const rule = signRule(field, leaf);
  const normal = pseudonormal(field, leaf, nearest);
  let isInside = rule === SIGN_BY.negative;
  if (rule === SIGN_BY.pseudonormal) isInside = isFace ? nearest.height < 0 : dot(nearest.difference, normal) < 0;
  if (rule === SIGN_BY.winding) isInside = windingAt(field, leaf, x) > 0;
  const value = isInside ? -distance : distance;
  /** @type {Vector} */
  let gradient = distance > 0 ? scaled(nearest.difference, 1 / value) : normalized(normal);
  if (isFace && rule === SIGN_BY.pseudonormal) gradient = normalized(normal);
  return { value: value - field.exact.offset, gradient };
}
