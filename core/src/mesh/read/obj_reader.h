#pragma once

#include "hpsdf/triangle_mesh.h"
#include "mesh/scan/input.h"

namespace hpsdf::mesh {

/// Reads a Wavefront OBJ file: the coordinates of `v` and the corners of `f`, with indices from 1 or, if they are
/// negative, back from the last vertex. A fourth coordinate of a vertex (the weight of rational curves) and colours are
/// ignored, as are groups, materials, lines, points and free-form surfaces. A backslash at the end of a line continues
/// it. Throws `Error` that names the line for a vertex or a face that cannot be read.
TriangleMesh readObj(Input& input);

}  // namespace hpsdf::mesh
