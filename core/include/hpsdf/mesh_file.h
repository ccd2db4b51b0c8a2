#pragma once

#include <filesystem>
#include <string>

#include "hpsdf/mesh_report.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// Prepares a mesh for distances:
/// - welds vertices of equal position,
/// - drops degenerate and duplicate triangles and unused vertices. A degenerate triangle that connects its neighbours
///   is replaced by an edge flip, because dropping it would open the mesh. A shared wall keeps both of its triangles,
///   so that each body is closed; a surface that is modelled with both sides keeps one,
/// - reverses the whole mesh when its signed volume is negative, and never single components, because the triangles of
///   a cavity face inward on purpose.
///
/// Throws `Error` (mesh) for indices out of range, coordinates that are not finite or beyond `kLargestCoordinate`, or
/// when no triangle with an area is left.
ImportedMesh cleaned(TriangleMesh mesh);

/// Reads an OBJ, PLY, STL, OFF, 3DS or glTF file through assimp, joins all meshes of the scene under their node
/// transforms, triangulates polygons, and returns the mesh `cleaned`.
///
/// assimp sets two limits. Positions pass through `float`: a relative error of 6e-8, which is 0.06 at coordinates near
/// 1e6 (see `coordinateSpacing`). Indices out of range are corrected without notice in OFF and PLY files, and their
/// faces dropped in glTF files, so that they cannot be reported.
///
/// The file is read in the caller's process without a limit of time or memory. A damaged file can crash assimp: a
/// deeply nested glTF file overflows its stack, others trigger its asserts, which are on in Debian. Other files keep
/// assimp, or the triangulation of a polygon with very many corners, busy for minutes. Read untrusted files in a
/// subprocess, as the program `hpsdf` does.
///
/// Throws `Error` (file or mesh, the subject is `file`) for a file that is missing, a folder, unreadable, empty or not
/// a mesh, and for a mesh beyond the range of float, too small for it, or without area.
ImportedMesh importMesh(const std::filesystem::path& file);

/// Distance between adjacent coordinates that the reader can tell apart, in mesh units: the spacing of `float` at the
/// largest coordinate of `mesh`, which was read from `file`. Numbers with exponents may be off by twice as much.
/// Returns 0 for a file that itself holds floats (3DS, glTF, binary STL and most binary PLY), so that reading loses
/// nothing, and for a file that is not a mesh.
double coordinateSpacing(const std::filesystem::path& file, const TriangleMesh& mesh);

/// The mesh of `importMesh`, or of `shapes::mesh` for a name that starts with `builtin:`.
TriangleMesh loadMesh(const std::string& fileOrShape);

/// Writes a mesh as OBJ or binary PLY, by the file's extension, with coordinates in full double precision. A PLY file
/// is written as text where its binary data would begin with a line feed, which `importMesh` could not read. The file
/// appears whole or not at all. Throws `Error` (file) for another extension, and as `OutputFile` does.
void saveMesh(const TriangleMesh& mesh, const std::filesystem::path& file);

/// Throws the `Error` that `saveMesh` would throw for this file name, as far as it is known beforehand. Call it
/// before long work.
void checkMeshWritable(const std::filesystem::path& file);

}  // namespace hpsdf
