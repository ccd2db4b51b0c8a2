// Numbers of cells, by which pictures are coloured on a logarithmic scale.

import { degreeOf, isExact } from "../field/field_file.js";
import { forEachLeaf } from "../field/leaves.js";

/** @typedef {import("../field/field_file.js").Field} Field */

/**
 * Returns the estimated RMS error of each leaf (Koschier et al. 2016): what its coefficients of the highest degree contribute. Exact
 * leaves have none.
 * @param {Field} field
 */
export function cellErrors(field) {
  const errors = new Float32Array(field.low.length);
  forEachLeaf(field, (node) => {
    if (isExact(field, node)) return;
    const degree = degreeOf(field, node);
    let at = field.first[node];
    let sum = 0;
    for (let i = 0; i <= degree; ++i)
      for (let j = 0; j <= degree - i; ++j) {
        const k = degree - i - j;
        at += k; // the last coefficient of a row in k is that of the highest degree
        sum += field.coefficients[at++] ** 2 / ((2 * i + 1) * (2 * j + 1) * (2 * k + 1));
      }
    errors[node] = Math.sqrt(sum);
  });
  return errors;
}

/**
 * Returns powers of ten at the ends of a scale for colours of cells. The lowest 1 % and the highest 0.1 % of the volume do not count,
 * and the scale has at most six decades.
 * @param {Field} field
 * @param {Float32Array} numbers  for each node
 * @returns {[number, number]}
 */
export function decadesOf(field, numbers) {
  /** @type {Map<number, number>} */
  const volumes = new Map();
  let total = 0;
  forEachLeaf(field, (node, depth) => {
    if (!(numbers[node] > 0)) return;
    const decade = Math.floor(Math.log10(numbers[node]));
    volumes.set(decade, (volumes.get(decade) ?? 0) + 8 ** -depth);
    total += 8 ** -depth;
  });
  const quantile = (/** @type {number} */ share) => {
    let sum = 0;
    return [...volumes.keys()].sort((a, b) => a - b).find((decade) => (sum += volumes.get(decade) ?? 0) > share * total) ?? -1;
  };
  const top = quantile(0.999) + 1;
  return [Math.min(Math.max(quantile(0.01), top - 6), top - 1), top];
}
