#pragma once

#include <filesystem>
#include <string>

#include "hpsdf/mesh_report.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// Prepares a mesh for distance queries:
/// - welds vertices of equal position,
/// - drops degenerate triangles, duplicate triangles and unused vertices. A degenerate triangle that connects its
///   neighbours is replaced by an edge flip, because dropping it would open the mesh. A wall that two bodies share
///   keeps both of its triangles, so that each body is closed; a double-sided surface keeps one of its sides,
/// - reverses the whole mesh if its signed volume is negative. The volume of an open mesh counts only if it exceeds
///   a hundredth of its box's volume. Single components are never reversed, because the triangles of a cavity face
///   inward on purpose.
///
/// Throws `Error` (mesh) for indices out of range, for coordinates that are not finite or beyond
/// `kLargestCoordinate`, and if no triangle with an area is left.
ImportedMesh cleaned(TriangleMesh mesh);

/// Reads an OBJ, PLY, STL, OFF, 3DS or glTF file through the library assimp, joins all meshes of the scene
/// under their node transforms, triangulates polygons, and returns the mesh `cleaned`.
///
/// assimp sets two limits. Positions pass through `float`, with a relative error of 6e-8, which is 0.06 at
/// coordinates near 1e6 (see `coordinateSpacing`). Indices out of range cannot be reported: assimp corrects
/// them without notice in OFF and PLY files, and drops their faces in glTF files.
///
/// The file is read in the caller's process without a limit of time or memory. A damaged file can crash assimp:
/// a deeply nested glTF file overflows its stack, others trigger its asserts, which are enabled in Debian's
/// package. Other files keep assimp, or the triangulation of a polygon with very many corners, busy for
/// minutes. Read untrusted files in a subprocess, as the program `hpsdf` does.
///
/// Throws `Error` (file or mesh, the subject is `file`) for a file that is missing, a folder, unreadable, empty
/// or not a mesh. Also throws `Error` for a mesh that exceeds the range of float, is too small for float, or
/// has no area.
ImportedMesh importMesh(const std::filesystem::path& file);

/// Returns the distance between adjacent coordinates that the reader of `file` can distinguish, in mesh units:
/// the spacing of `float` at the largest coordinate of `mesh`, which was read from `file`. Coordinates that are
/// written with exponents may be off by twice this distance. Returns 0 for a file that itself holds floats
/// (3DS, glTF, binary STL and most binary PLY), because reading loses nothing, and for a file that is not a
/// mesh.
double coordinateSpacing(const std::filesystem::path& file, const TriangleMesh& mesh);

/// Returns the mesh of a file, as `importMesh` does, or the mesh of a built-in shape, as `shapes::mesh` does,
/// for a name that starts with `builtin:`.
TriangleMesh loadMesh(const std::string& fileOrShape);

/// Writes a mesh as OBJ or binary PLY, depending on the file's extension, with coordinates in full double
/// precision. A PLY file is written as text if its binary data would begin with a line feed, because
/// `importMesh` could not read such a file. The file appears whole or not at all. Throws `Error` (file) for
/// another extension, and as `OutputFile` does.
void saveMesh(const TriangleMesh& mesh, const std::filesystem::path& file);

/// Checks before long work whether `saveMesh` can write this file, as far as this can be foreseen. Throws the `Error`
/// that `saveMesh` would throw.
void checkMeshWritable(const std::filesystem::path& file);

}  // namespace hpsdf
