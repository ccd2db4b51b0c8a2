#version 300 es
// The edges of cells as lines in space.

uniform vec3 eye, forward, right, up;  // of the camera; lengths in the field's units
uniform bool parallel;
uniform float height;  // of the picture, pixels

layout(location = 0) in vec4 end;  // an end of an edge, and the edge's length

out vec3 fromEye;
out vec3 position;
out float pixels;  // length of the edge in the picture

void main() {
  position = end.xyz;
  vec3 away = end.xyz - eye;
  float depth = dot(away, forward);
  float w = parallel ? 1.0 : depth;
  gl_Position = vec4(dot(away, right) / dot(right, right), dot(away, up) / dot(up, up), 0.0, w);
  fromEye = parallel ? vec3(depth, 0.0, 0.0) : away;
  pixels = 0.5 * height * end.w / (length(up) * max(w, 1e-6));
}
