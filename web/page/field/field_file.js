// Reads the bytes of a .hpsdf file without compressed arrays (docs/file-format.md).

/** @typedef {[number, number, number]} Vector */

/**
 * The triangles of exact leaves.
 * @typedef {object} ExactTriangles
 * @property {Float32Array | Float64Array} vertices  coordinates of the vertices, three each, in the field's units
 * @property {Uint32Array} triangles  indices of vertices, three for each triangle
 * @property {Uint32Array} lists  the lists of triangles
 * @property {number} offset  the length that is subtracted from distances
 */

/**
 * A field as its file holds it, with coefficients that are no longer quantized.
 * @typedef {object} Field
 * @property {string} name  the source's name
 * @property {Vector} grid  base cells along each axis
 * @property {Vector} lower  the domain's lower corner, in the field's units
 * @property {Vector} upper
 * @property {Vector} size
 * @property {[Vector, Vector]} box  corners of the part of the domain around the surface; of the whole domain where it is unknown
 * @property {number} targetError
 * @property {number} tolerance
 * @property {number} blend  width of the blended zones as a part of a cell's edges; 0: none
 * @property {Float32Array | null} zones  of a blended field: the three BlendZoneBounds of each node
 * @property {{near: number, nearRms: number, nearMax: number, rms: number, max: number} | null} measured
 * @property {Uint32Array} low  the low halves of the nodes
 * @property {Uint32Array} high  the high halves of the nodes
 * @property {Uint32Array} first  for each leaf with a polynomial, the index of its first coefficient
 * @property {Float32Array | Float64Array} coefficients
 * @property {ExactTriangles} exact
 * @property {number} bytes  the size of the file
 */

/** An error that the reader of the page can understand. */
export class FieldError extends Error {}

const MAGIC = [0x68, 0x70, 0x73, 0x64, 0x66, 0x0d, 0x0a, 0x1a];
const VERSION = 12;
const ALIGNMENT = 64; // of arrays
const BLOCK_BYTES = 65536; // that have a checksum
const MOST_DEGREES = 30;
const MOST_LEVELS = 20;
const MOST_BLEND = 0.25;
export const EXACT_DEGREE = 31;

/**
 * @param {number} degree
 */
export function coefficientCount(degree) {
  return ((degree + 1) * (degree + 2) * (degree + 3)) / 6;
}

/**
 * @param {Field} field
 * @param {number} node
 */
export function isLeaf(field, node) {
  return field.high[node] >>> 31 === 1;
}

/**
 * @param {Field} field
 * @param {number} leaf
 */
export function degreeOf(field, leaf) {
  return field.high[leaf] & 0xff;
}

/**
 * @param {Field} field
 * @param {number} leaf
 */
export function isExact(field, leaf) {
  return degreeOf(field, leaf) === EXACT_DEGREE;
}

/** Reads numbers one after the other, and says so where the bytes end too early. */
class Cursor {
  /**
   * @param {Uint8Array} bytes
   */
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.at = 0;
  }

  /**
   * @param {number} count
   */
  skip(count) {
    if (!(count <= this.bytes.length - this.at)) throw new FieldError("the field is damaged: it ends too early");
    this.at += count;
    return this.at - count;
  }

  align() {
    this.skip((ALIGNMENT - (this.at % ALIGNMENT)) % ALIGNMENT);
  }

  u8() {
    return this.view.getUint8(this.skip(1));
  }
  u32() {
    return this.view.getUint32(this.skip(4), true);
  }
  f64() {
    return this.view.getFloat64(this.skip(8), true);
  }
  u64() {
    const value = this.view.getBigUint64(this.skip(8), true);
    return Number(value);
  }
  /**
   * @returns {Vector}
   */
  vector() {
    return [this.f64(), this.f64(), this.f64()];
  }

  /**
   * Reads bytes.
   * @param {number} size
   * @returns {ArrayBuffer}
   */
  take(size) {
    const from = this.skip(size);
    return this.bytes.slice(from, from + size).buffer;
  }

  /**
   * Reads the bytes of an array, which begins at a multiple of the alignment.
   * @param {number} size
   */
  array(size) {
    this.align();
    return this.take(size);
  }

  /**
   * Reads floats of 4 or of 8 bytes.
   * @param {number} count
   * @param {number} size  bytes of one
   */
  floats(count, size) {
    return size === 8 ? new Float64Array(this.array(8 * count)) : new Float32Array(this.array(4 * count));
  }

  /**
   * @param {number} count
   */
  words(count) {
    return new Uint32Array(this.array(4 * count));
  }
}

/**
 * @param {Uint8Array} bytes
 * @returns {Field}
 */
export function readField(bytes) {
  const cursor = new Cursor(bytes);
  const header = readHeader(cursor);
  const nodes = cursor.words(2 * header.nodes);
  const low = new Uint32Array(header.nodes), high = new Uint32Array(header.nodes);
  for (let n = 0; n < header.nodes; ++n) {
    low[n] = nodes[2 * n];
    high[n] = nodes[2 * n + 1];
  }
  const isQuantized = header.coefficientBytes === 1;
  const quantized = new Uint8Array(cursor.array(isQuantized ? header.coefficients : 0));
  const plain = cursor.floats(isQuantized ? 0 : header.coefficients, header.coefficientBytes);
  cursor.align();
  cursor.skip(header.bounds * 8);
  const exact = {
    vertices: cursor.floats(3 * header.vertices, header.vertexBytes),
    triangles: cursor.words(3 * header.triangles),
    lists: cursor.words(header.lists),
    offset: header.offset,
  };
  cursor.skip(8 * Math.ceil(cursor.at / BLOCK_BYTES) + 8); // checksums, in place of which the zlib stream has its own
  const bytesOfFile = cursor.at;
  const zones = header.blend > 0 ? readZones(cursor, header) : null;
  const first = new Uint32Array(low.length);
  const { name, grid, lower, upper, targetError, tolerance, blend, measured } = header;
  const size = /** @type {Vector} */ (upper.map((x, axis) => x - lower[axis]));
  /** @type {Field} */
  const field = {
    name, grid, lower, upper, size, box: withinDomain(header.box, lower, upper), targetError, tolerance, blend, zones, measured, low, high, first,
    coefficients: new Float32Array(0), exact, bytes: bytesOfFile,
  };
  checkTree(field);
  field.coefficients = isQuantized ? dequantized(field, quantized, header.step, header.meanBits) : placed(field, plain);
  return field;
}

/**
 * Returns the part of a box within the domain, or the domain if there is none.
 * @param {[Vector, Vector]} box
 * @param {Vector} lower
 * @param {Vector} upper
 * @returns {[Vector, Vector]}
 */
function withinDomain(box, lower, upper) {
  const low = /** @type {Vector} */ (box[0].map((x, a) => Math.max(x, lower[a])));
  const high = /** @type {Vector} */ (box[1].map((x, a) => Math.min(x, upper[a])));
  return low.every((x, a) => x <= high[a]) ? [low, high] : [lower, upper];
}

/**
 * Reads the bounds of blend zones, which the program writes behind the file.
 * @param {Cursor} cursor
 * @param {{nodes: number, blend: number}} header
 */
function readZones(cursor, { nodes, blend }) {
  if (blend > MOST_BLEND) throw new FieldError("the field is damaged: its blended zones are too wide");
  const zones = new Float32Array(cursor.take(3 * 4 * nodes));
  if (!zones.every((bound) => bound >= 0)) throw new FieldError("the field is damaged: a bound of its blended zones is no number");
  return zones;
}

/**
 * @param {Cursor} cursor
 */
function readHeader(cursor) {
  if (MAGIC.some((byte) => cursor.u8() !== byte)) throw new FieldError("this is no field");
  const version = cursor.u32();
  if (version !== VERSION) throw new FieldError(`the field has the unknown version ${version}`);
  const coefficientBytes = cursor.u32();
  const nodes = cursor.u64();
  const coefficients = cursor.u64();
  const grid = /** @type {Vector} */ ([cursor.u32(), cursor.u32(), cursor.u32()]);
  const lower = cursor.vector();
  const upper = cursor.vector();
  const nameLength = cursor.u32();
  const nameAt = cursor.skip(nameLength);
  const name = new TextDecoder().decode(cursor.bytes.subarray(nameAt, nameAt + nameLength));
  cursor.skip(3 * 8); // fingerprint, vertices, faces
  const box = /** @type {[Vector, Vector]} */ ([cursor.vector(), cursor.vector()]);
  cursor.skip(4 * 8); // the normalization
  const targetError = cursor.f64();
  cursor.skip(3 * 8 + 3 * 4 + 1 + 4 * 8 + 3 + 2 * 8 + 1 + 8);
  const blend = cursor.f64();
  const bounds = cursor.u64();
  cursor.skip(1 + 2 * 8 + 4 + 8); // inside test, thickness, exact leaves
  const tolerance = cursor.f64();
  cursor.skip(8 + 3 + 8); // within, certified, cubature, trial samples, limit of bytes
  const vertexBytes = cursor.u32();
  const vertices = cursor.u64();
  const triangles = cursor.u64();
  const lists = cursor.u64();
  const offset = cursor.f64();
  const points = cursor.u64();
  let measured = null;
  if (points > 0) {
    const near = cursor.f64();
    const [nearRms, nearMax, rms, max] = [cursor.f64(), cursor.f64(), cursor.f64(), cursor.f64()];
    measured = { near, nearRms, nearMax, rms, max };
    cursor.skip(8 + 2 * 8 + 3 * 8 + 8 + 8);
  }
  if (cursor.u8() > 0) cursor.skip(1); // exactness
  const isQuantized = coefficientBytes === 1;
  const step = isQuantized ? cursor.f64() : 0;
  const meanBits = isQuantized ? cursor.u32() : 0;
  return {
    coefficientBytes, nodes, coefficients, grid, lower, upper, box, name, targetError, tolerance, blend, bounds, vertexBytes, vertices,
    triangles, lists, offset, measured, step, meanBits,
  };
}

/**
 * Checks that the nodes form trees, so that no walk through them fails or goes on for ever.
 * @param {Field} field
 */
function checkTree(field) {
  const { grid, low, high, exact } = field;
  const count = low.length;
  const depth = new Uint8Array(count);
  const bases = grid[0] * grid[1] * grid[2];
  if (!(bases > 0 && bases <= count)) throw new FieldError("the field is damaged: base cells are missing");
  for (let n = 0; n < count; ++n) {
    if (isLeaf(field, n)) {
      const degree = high[n] & 0xff;
      if (degree > MOST_DEGREES && degree !== EXACT_DEGREE) throw new FieldError("the field is damaged: a degree is too high");
      if (degree === EXACT_DEGREE && low[n] >= exact.lists.length) throw new FieldError("the field is damaged: a list is missing");
    } else {
      if (low[n] <= n || low[n] + 8 > count || depth[n] >= MOST_LEVELS) throw new FieldError("the field is damaged: its cells form no octree");
      depth.fill(depth[n] + 1, low[n], low[n] + 8);
    }
  }
}

/**
 * Returns coefficients that are not quantized, and sets where those of each leaf begin.
 * @template {Float32Array | Float64Array} T
 * @param {Field} field
 * @param {T} stored
 * @returns {T}
 */
function placed(field, stored) {
  const { low, first } = field;
  for (let n = 0; n < low.length; ++n) {
    if (!isLeaf(field, n) || isExact(field, n)) continue;
    if (low[n] + coefficientCount(degreeOf(field, n)) > stored.length) throw new FieldError("the field is damaged: a leaf lacks coefficients");
    first[n] = low[n];
  }
  return stored;
}

/**
 * Reads numbers of a few bits each, the lowest bit of a byte first.
 */
class BitReader {
  /**
   * @param {Uint8Array} bytes
   * @param {number} at  the index of the first byte
   */
  constructor(bytes, at) {
    this.bytes = bytes;
    this.bit = 8 * at;
  }

  /**
   * @param {number} count  at most 32
   */
  read(count) {
    let value = 0;
    for (let have = 0; have < count; ) {
      const inByte = this.bit & 7;
      const take = Math.min(8 - inByte, count - have);
      const bits = (this.bytes[this.bit >> 3] >> inByte) & ((1 << take) - 1);
      value += bits * 2 ** have;
      have += take;
      this.bit += take;
    }
    return value;
  }
}

/**
 * Returns the coefficients of all leaves from their integers, and sets where those of each leaf begin.
 * @param {Field} field
 * @param {Uint8Array} stored
 * @param {number} step
 * @param {number} meanBits
 */
function dequantized(field, stored, step, meanBits) {
  const { low, high, first } = field;
  let total = 0;
  for (let n = 0; n < low.length; ++n) {
    if (!isLeaf(field, n) || isExact(field, n)) continue;
    if (low[n] >= stored.length) throw new FieldError("the field is damaged: a leaf lacks coefficients");
    first[n] = total;
    total += coefficientCount(degreeOf(field, n));
  }
  const coefficients = new Float32Array(total);
  for (let n = 0; n < low.length; ++n) {
    if (!isLeaf(field, n) || isExact(field, n)) continue;
    const isWide = (high[n] >>> 21) & 1;
    const leafStep = step * 2 ** -((high[n] >>> 16) & 31);
    dequantizeLeaf(new BitReader(stored, low[n]), degreeOf(field, n), leafStep, isWide ? 32 : meanBits, coefficients, first[n]);
  }
  return coefficients;
}

/**
 * The coefficients of a leaf in the order of the file, by total degree: for each the place among the coefficients and the scale.
 * @typedef {{place: number, scale: number}[][]} FileOrder
 */

/** @type {Map<number, FileOrder>} */
const orderOfDegree = new Map();

/**
 * @param {number} degree
 * @returns {FileOrder}
 */
function fileOrder(degree) {
  const known = orderOfDegree.get(degree);
  if (known) return known;
  /** @type {FileOrder} */
  const order = Array.from({ length: degree + 1 }, () => []);
  for (let i = 0; i <= degree; ++i)
    for (let j = 0; j <= degree - i; ++j)
      for (let k = 0; k <= degree - i - j; ++k)
        order[i + j + k].push({ place: coefficientIndex(degree, i, j, k), scale: Math.sqrt((2 * i + 1) * (2 * j + 1) * (2 * k + 1)) });
  orderOfDegree.set(degree, order);
  return order;
}

/**
 * @param {BitReader} reader
 * @param {number} degree
 * @param {number} step
 * @param {number} meanBits
 * @param {Float32Array} out
 * @param {number} to  the index of the leaf's first coefficient
 */
function dequantizeLeaf(reader, degree, step, meanBits, out, to) {
  const widths = [meanBits];
  for (let d = 1; d <= degree; ++d) widths.push(reader.read(5));
  const order = fileOrder(degree);
  for (let d = 0; d <= degree; ++d) {
    const width = widths[d];
    if (width === 0) continue; // all of them are zero
    const zero = 2 ** (width - 1);
    for (const { place, scale } of order[d]) out[to + place] = (reader.read(width) - zero) * step * scale;
  }
}

/**
 * Returns the place of c_ijk among the coefficients of a leaf, which are in lexicographic order of (i, j, k).
 * @param {number} degree
 * @param {number} i
 * @param {number} j
 * @param {number} k
 */
export function coefficientIndex(degree, i, j, k) {
  const rest = degree - i;
  const before = coefficientCount(degree) - coefficientCount(rest); // those with a smaller i
  return before + j * (rest + 1) - (j * (j - 1)) / 2 + k;
}
