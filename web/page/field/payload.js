// The fields that stand in the page, as text.

import { FieldError } from "./field_file.js";

const ALPHABET = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/**
 * Returns the bytes that are written in base64. White space around them is left out.
 * @param {string} text
 */
function bytesOf(text) {
  const digits = new Uint8Array(128).fill(255);
  [...ALPHABET].forEach((character, value) => (digits[character.charCodeAt(0)] = value));
  const trimmed = text.trim();
  const length = trimmed.endsWith("==") ? trimmed.length - 2 : trimmed.endsWith("=") ? trimmed.length - 1 : trimmed.length;
  const bytes = new Uint8Array(Math.floor((3 * length) / 4));
  let have = 0, bits = 0, to = 0;
  for (let at = 0; at < length; ++at) {
    const digit = digits[trimmed.charCodeAt(at)];
    if (!(digit < 64)) throw new FieldError("its text is damaged");
    bits = (bits << 6) | digit;
    have += 6;
    if (have < 8) continue;
    have -= 8;
    bytes[to++] = (bits >> have) & 0xff;
  }
  return bytes;
}

/**
 * Returns the bytes of a zlib stream that is written in base64.
 * @param {string} text
 */
export async function inflated(text) {
  const bytes = bytesOf(text);
  try {
    // @ts-ignore: TypeScript 4.8 does not know DecompressionStream, which browsers have had since 2023
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  } catch {
    throw new FieldError("its compressed bytes are damaged");
  }
}
