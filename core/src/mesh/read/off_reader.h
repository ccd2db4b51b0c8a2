#pragma once

#include "hpsdf/triangle_mesh.h"
#include "mesh/scan/input.h"

namespace hpsdf::mesh {

/// Reads an OFF file with three coordinates a vertex: OFF, or with colours, normals or texture coordinates (COFF, NOFF,
/// STOFF and their combinations), which are skipped. Comments and white space may stand anywhere, but the colour of a
/// face ends with its line. Throws `Error` that names the line for a file that is damaged or binary, for one that holds
/// less or more than its header promises, and for vertices of four or more dimensions. Source: the Geomview manual.
TriangleMesh readOff(Input& input);

}  // namespace hpsdf::mesh
