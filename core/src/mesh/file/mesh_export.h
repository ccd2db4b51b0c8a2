#pragma once
// Meshes as text (OBJ) and as binary data (PLY).

#include "hpsdf/detail/output_file.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

void writeObj(const TriangleMesh& mesh, OutputFile& out);

/// Writes text where binary data would begin with the byte of a line feed, which readers would take for the header's.
void writePly(const TriangleMesh& mesh, OutputFile& out);

}  // namespace hpsdf
