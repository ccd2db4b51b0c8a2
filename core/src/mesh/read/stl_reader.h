#pragma once

#include "hpsdf/triangle_mesh.h"
#include "mesh/scan/input.h"

namespace hpsdf::mesh {

/// Reads an STL file, binary or text. A file whose length is that of a binary file with as many faces as it promises is
/// binary, even if it begins with "solid". Every face has vertices of its own. Throws `Error` that names the line or
/// the byte for a file that is damaged, or that holds less or more than it promises.
TriangleMesh readStl(Input& input);

}  // namespace hpsdf::mesh
