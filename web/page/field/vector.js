// Vectors of three numbers.

/** @typedef {import("./field_file.js").Vector} Vector */

/**
 * @param {Vector} a
 * @param {Vector} b
 * @returns {Vector}
 */
export function add(a, b) {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

/**
 * @param {Vector} a
 * @param {Vector} b
 * @returns {Vector}
 */
export function subtract(a, b) {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

/**
 * @param {Vector} a
 * @param {number} s
 * @returns {Vector}
 */
export function scaled(a, s) {
  return [a[0] * s, a[1] * s, a[2] * s];
}

/**
 * @param {Vector} a
 * @param {Vector} b
 */
export function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/**
 * @param {Vector} a
 * @param {Vector} b
 * @returns {Vector}
 */
export function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/**
 * @param {Vector} a
 */
export function length(a) {
  return Math.sqrt(dot(a, a));
}

/**
 * Returns the vector of length 1 in this direction, or 0 for a vector of length 0.
 * @param {Vector} a
 * @returns {Vector}
 */
export function normalized(a) {
  const size = length(a);
  return size > 0 ? [a[0] / size, a[1] / size, a[2] / size] : [0, 0, 0];
}
