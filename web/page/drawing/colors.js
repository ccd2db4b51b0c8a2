// The program's colours (render/src/image/color_maps.cpp), as linear light.

import { EXACT_DEGREE } from "../field/field_file.js";

/** @typedef {[number, number, number]} Color  red, green and blue from 0 to 1 */

/**
 * @param {number} x  linear light
 */
function encodeChannel(x) {
  return x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;
}

/**
 * @param {number} x  encoded light
 */
function decodeChannel(x) {
  return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
}

/**
 * @param {string} hex  "#rrggbb"
 * @returns {Color}
 */
function fromHex(hex) {
  const channel = (/** @type {number} */ at) => decodeChannel(parseInt(hex.slice(at, at + 2), 16) / 255);
  return [channel(1), channel(3), channel(5)];
}

/**
 * Returns the linear light of Oklab coordinates (Ottosson 2020).
 * @param {number} lightness
 * @param {number} a
 * @param {number} b
 * @returns {Color}
 */
function oklabToLinear(lightness, a, b) {
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
  ];
}

/**
 * Returns the colour, with as much chroma as sRGB can show.
 * @param {number} lightness
 * @param {number} a
 * @param {number} b
 * @returns {Color}
 */
function fromOklab(lightness, a, b) {
  const fits = (/** @type {Color} */ c) => c.every((x) => x >= -1e-5 && x <= 1 + 1e-5);
  let color = oklabToLinear(lightness, a, b);
  if (!fits(color)) {
    let inside = 0, outside = 1;
    for (let i = 0; i < 24; ++i) {
      const middle = (inside + outside) / 2;
      if (fits(oklabToLinear(lightness, middle * a, middle * b))) inside = middle;
      else outside = middle;
    }
    color = oklabToLinear(lightness, inside * a, inside * b);
  }
  return /** @type {Color} */ (color.map((x) => Math.min(Math.max(x, 0), 1)));
}

/**
 * @param {number} lightness
 * @param {number} chroma
 * @param {number} hue  degrees
 */
function fromOklch(lightness, chroma, hue) {
  const angle = (hue * Math.PI) / 180;
  return fromOklab(lightness, chroma * Math.cos(angle), chroma * Math.sin(angle));
}

/**
 * A colour of the scale from dark violet (0) over teal to golden yellow (1).
 * @param {number} t
 */
export function orderedColor(t) {
  const at = Math.min(Math.max(t, 0), 1);
  const chroma = 0.103 + (at < 0.5 ? 0.034 : 0.067) * (2 * at - 1) ** 2;
  return fromOklch(0.385 + 0.445 * at, chroma, 302 - 227 * at ** 0.8);
}

const LEVELS = ["#fcd209", "#959f63", "#479d98", "#1652b0", "#584b57", "#560813"];

/**
 * The colour of a level, which is a degree or a depth, or of exact cells.
 * @param {number} level
 */
export function levelColor(level) {
  if (level === EXACT_DEGREE) return fromHex("#b42405");
  if (level < LEVELS.length) return fromHex(LEVELS[level]);
  return fromOklch(0.38 + 0.44 * 0.87 ** (level - LEVELS.length), 0.15, 130);
}

/**
 * A colour from blue (−1) over white (0) to red (1).
 * @param {number} t
 */
export function divergingColor(t) {
  const white = [0.985, 0, 0];
  const middle = t < 0 ? [0.77, -0.045, -0.105] : [0.8, 0.07, 0.085];
  const end = t < 0 ? [0.36, -0.015, -0.135] : [0.4, 0.125, 0.07];
  const s = Math.min(Math.abs(t), 1);
  const bend = (/** @type {number} */ i) => (1 - s) ** 2 * white[i] + 2 * s * (1 - s) * middle[i] + s * s * end[i];
  return fromOklab(bend(0), bend(1), bend(2));
}

/**
 * Returns the colour as CSS writes it.
 * @param {Color} color
 */
export function cssColor(color) {
  return `rgb(${color.map((x) => Math.round(255 * encodeChannel(x))).join(" ")})`;
}

/**
 * Returns the colour of letters that can be read on a colour.
 * @param {Color} color
 */
export function letterColor(color) {
  return 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2] > 0.25 ? "#000" : "#fff";
}
