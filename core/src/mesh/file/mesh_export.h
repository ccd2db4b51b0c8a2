#pragma once

#include "hpsdf/detail/output_file.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

void writeObj(const TriangleMesh& mesh, OutputFile& out);

/// Writes binary data, or text where binary data would begin with the byte of a line feed: readers would take it for a
/// part of the header.
void writePly(const TriangleMesh& mesh, OutputFile& out);

}  // namespace hpsdf::mesh
