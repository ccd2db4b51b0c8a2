#pragma once

#include <filesystem>
#include <string>

#include "hpsdf/mesh_report.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// Welds equal positions, drops degenerate and duplicate faces and unused vertices (a face on one line that keeps its
/// neighbours connected is mended by an edge flip instead: dropping it would open the mesh), and turns the *whole* mesh
/// when its signed volume is negative (never part by part: a cavity's faces look inward on purpose). Of a wall that two
/// bodies share both faces stay, one each way, so that each body is closed; of a surface given with both its sides one
/// does. Throws `Error` for indices out of range, coordinates that are not finite or beyond `kLargestCoordinate`, or
/// when no face with an area is left.
ImportedMesh cleaned(TriangleMesh mesh);

/// Reads OBJ, PLY, STL, OFF, 3DS or glTF (through assimp), all meshes of the scene joined under their node transforms,
/// n-gons triangulated, then `cleaned`.
///
/// Two limits come from assimp: positions pass through `float` (relative 6e-8, which is 0.06 at coordinates near 1e6;
/// see `coordinateSpacing`), and indices out of range in OFF and PLY files are mended (in glTF files, their faces left
/// out) silently, so that they cannot be reported.
///
/// It reads within the caller's process, without a limit of time or memory, and what brings assimp down brings that
/// process down: a deeply nested glTF file its stack, others its asserts, which are on in Debian. Some files keep it,
/// or the cutting of a face with very many corners, above all one that crosses itself, busy for minutes. For files from
/// strangers do as the program `hpsdf` does, and read in a process of its own.
///
/// Throws `Error` naming the file: missing, a lookup grid, unreadable, empty, not a mesh, beyond float's range or too
/// small for it, or without area.
ImportedMesh importMesh(const std::filesystem::path& file);

/// How far apart the reader keeps coordinates, in mesh units: the spacing of `float` at the largest one of `mesh`,
/// which was read from `file`; numbers with exponents may be off by twice as much. 0 where that holds floats itself, so
/// that reading loses nothing (3DS, glTF, binary STL and most binary PLY), and for what is no mesh file.
double coordinateSpacing(const std::filesystem::path& file, const TriangleMesh& mesh);

/// The mesh of `importMesh`, or, for a name that starts with `builtin:`, the shape of `shapes::mesh`.
TriangleMesh loadMesh(const std::string& fileOrShape);

/// Writes a mesh as OBJ or binary PLY, by the file's extension, coordinates in double to the last digit. (PLY as text
/// where its data would begin with the byte of a line feed, which `importMesh` could not read.) The file appears whole
/// or not at all. Throws `Error` for another extension, and as `OutputFile` does.
void saveMesh(const TriangleMesh& mesh, const std::filesystem::path& file);

/// Throws what `saveMesh` would for the file's name, as far as it can be told beforehand: before long work.
void checkMeshWritable(const std::filesystem::path& file);

}  // namespace hpsdf
