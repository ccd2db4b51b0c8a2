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
/// Throws `Error` (of the kind `mesh`) for indices out of range, for coordinates that are not finite or beyond
/// `kLargestCoordinate`, and if no triangle with an area is left.
ImportedMesh cleaned(TriangleMesh mesh);

/// Reads an OBJ, PLY, STL, OFF, 3DS or glTF file through the library assimp, joins all meshes of the scene
/// under their node transforms, triangulates polygons, and passes the joined mesh to `cleaned`.
///
/// assimp has two limitations. It stores positions as `float`, with a relative error of 6e-8: an error of 0.06 at
/// coordinates near 1e6 (see `coordinateSpacing`). It also hides indices out of range: it corrects them without
/// notice in OFF and PLY files, and drops their faces in glTF files.
///
/// The file is read in the caller's process without a limit of time or memory. A damaged file can crash assimp: a
/// deeply nested glTF file overflows the stack, and other files trigger asserts, which are enabled in Debian's package
/// of assimp. Some files keep assimp busy for minutes; the triangulation of a polygon with very many corners can take
/// minutes too. Read untrusted files in a subprocess, as the program `hpsdf` does.
///
/// Throws `Error` (of the kind `file` or `mesh`, with the subject `file`) for a file that is missing, a folder,
/// unreadable, empty or not a mesh. Also throws `Error` for a mesh that exceeds the range of float, is too small
/// for float, or has no area.
ImportedMesh importMesh(const std::filesystem::path& file);

/// Tells whether a file's name ends as the names of mesh files that `importMesh` reads.
bool isMeshFileName(const std::filesystem::path& file);

/// Returns the spacing, in mesh units, to which assimp rounds the coordinates of `mesh` when it reads them from
/// `file`: the spacing of `float` numbers at the largest coordinate. Coordinates that are written with exponents
/// may be off by twice this spacing. Returns 0 if `file` itself holds floats (3DS, glTF, binary STL and most
/// binary PLY), because assimp then loses nothing. Also returns 0 for a file that is not a mesh.
double coordinateSpacing(const std::filesystem::path& file, const TriangleMesh& mesh);

/// Returns the mesh of a built-in shape (`shapes::mesh`) if the name starts with `builtin:`, else the mesh of the file
/// with this name (`importMesh`).
TriangleMesh loadMesh(const std::string& fileOrShape);

/// Writes a mesh as OBJ or binary PLY, depending on the file's extension, with coordinates in full double precision. A
/// PLY file is written as text if its binary data would begin with a line feed, because `importMesh` could not read
/// such a file. The file appears whole or not at all. Throws `Error` (of the kind `file`) for another extension, and as
/// `OutputFile` does.
void saveMesh(const TriangleMesh& mesh, const std::filesystem::path& file);

/// Throws the `Error` that `saveMesh` would throw for this file, as far as it can be foreseen. A caller thus learns
/// before long work that it could not write the file.
void checkMeshWritable(const std::filesystem::path& file);

}  // namespace hpsdf
