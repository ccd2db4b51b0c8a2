// Which triangle of which body a pixel sees; all else follows from that in double precision.

flat in uint body;

layout(location = 0) out uvec2 bodyTriangle;

void main() { bodyTriangle = uvec2(body, uint(gl_PrimitiveID)); }
