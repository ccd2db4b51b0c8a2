// Writes the indices of the body and the triangle that a pixel sees; the CPU computes the rest in double precision.

flat in uint body;

layout(location = 0) out uvec2 bodyTriangle;

void main() { bodyTriangle = uvec2(body, uint(gl_PrimitiveID)); }
