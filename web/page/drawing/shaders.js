// The program's shaders for WebGL 2: the same sources, translated to GLSL ES 3.00, which has neither buffer textures nor double
// precision nor ldexp.

/** The textures that are buffer textures in OpenGL 4.5. Here their texels stand in rows of ROW. */
const BUFFERS = ["nodes", "coefficients", "coefficientQuads", "linearParts", "zones", "exactLists", "exactCorners"];
export const ROW_BITS = 11;
export const ROW = 1 << ROW_BITS;

const HEADER = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
precision highp isampler2D;
#define HPSDF_WEB
ivec2 texelOf(int index) { return ivec2(index & ${ROW - 1}, index >> ${ROW_BITS}); }
float ldexp(float x, int e) { return x * uintBitsToFloat(uint(e + 127) << 23); }
vec3 ldexp(vec3 x, ivec3 e) { return x * uintBitsToFloat(uvec3(e + 127) << 23); }
`;

/**
 * Returns the text with every call texelFetch(name, index) of a buffer as one of a texture.
 * @param {string} text
 */
function withTextures(text) {
  const call = new RegExp(`texelFetch\\((${BUFFERS.join("|")}), `, "g");
  let result = "";
  let from = 0;
  for (let found = call.exec(text); found; found = call.exec(text)) {
    let end = call.lastIndex;
    for (let depth = 1; depth > 0; ++end) depth += text[end] === "(" ? 1 : text[end] === ")" ? -1 : 0;
    const index = withTextures(text.slice(call.lastIndex, end - 1));
    result += `${text.slice(from, found.index)}texelFetch(${found[1]}, texelOf(${index}), 0)`;
    from = call.lastIndex = end;
  }
  return result + text.slice(from);
}

/**
 * Returns the source of one shader from files of the program.
 * @param {string[]} parts
 */
export function webShader(parts) {
  const text = parts
    .join("\n")
    .replace(/layout\(binding = \d+\) uniform (u?)samplerBuffer/g, "uniform $1sampler2D")
    .replace(/layout\((binding|location) = \d+\) uniform/g, "uniform")
    .replace(/1e300lf/g, "1e30")
    .replace(/(\d)lf\b/g, "$1")
    .replace(/\bdvec([23])\b/g, "vec$1")
    .replace(/\bdouble\b/g, "float")
    .replace(/\bprecise /g, "");
  return HEADER + withTextures(text);
}
