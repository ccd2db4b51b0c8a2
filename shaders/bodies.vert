// Transforms the vertices of a mesh. The mesh is drawn once for each of its bodies, by instancing.

layout(location = 0) in vec3 position;  // relative to the centre of the mesh's bounding sphere
layout(location = 1) in mat4 targetFromMesh;
layout(location = 5) in uint index;

flat out uint body;

void main() {
  gl_Position = targetFromMesh * vec4(position, 1.0);
  body = index;
}
