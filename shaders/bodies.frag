// Writes the indices of the body and of the triangle that is visible in a pixel. The CPU computes distances and normals
// in double precision.

flat in uint body;

layout(location = 0) out uvec2 bodyTriangle;

void main() { bodyTriangle = uvec2(body, uint(gl_PrimitiveID)); }
