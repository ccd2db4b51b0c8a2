// A mesh, each instance a body.

layout(location = 0) in vec3 position;  // about the mesh's middle
layout(location = 1) in mat4 targetFromMesh;
layout(location = 5) in uint index;

flat out uint body;

void main() {
  gl_Position = targetFromMesh * vec4(position, 1.0);
  body = index;
}
