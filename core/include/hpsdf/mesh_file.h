#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "hpsdf/error.h"
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

/// Reads a mesh file (docs/meshes.md), triangulates its polygons, and passes the mesh to `cleaned`. The extension of
/// the file's name tells the format: OBJ, PLY, STL and OFF, also compressed by gzip (`.ply.gz`); glTF (`.gltf`,
/// `.glb`), whose meshes are joined under their node transforms; and 3DS. Coordinates keep all digits that the file
/// has.
///
/// 3DS files are read by the library assimp, and meshes in glTF files that Draco has compressed by its library, in the
/// caller's process and without a limit of time or memory. A damaged file can crash these libraries, or keep them busy
/// for minutes. Read untrusted files of these kinds (`isReadByOthers`) in a subprocess, as the program `hpsdf` does.
///
/// Throws `Error` (of the kind `file` or `mesh`, with the subject `file`) for a file that is missing, a folder,
/// unreadable, empty or not a mesh; that holds less or more than its header promises; with indices out of range or
/// numbers that are not finite; and for a mesh that has no area. The message names the line, the byte or the element.
/// Throws `Error` of the kind `limit` for a mesh that does not fit into memory, and `Cancelled` when `progress` says
/// so.
ImportedMesh importMesh(const std::filesystem::path& file, const Progress& progress = {});

/// Reads a mesh file as `importMesh` does, but does not clean the mesh. The mesh has the name `file`.
TriangleMesh readMesh(const std::filesystem::path& file, const Progress& progress = {});

/// Reads a mesh from the bytes of a PLY file, and does not clean it. `name` names it in errors.
TriangleMesh readPly(std::string_view bytes, const std::string& name, const Progress& progress = {});

/// Returns true if a library that a damaged file can crash, or keep busy for minutes, takes part in reading this file:
/// assimp for 3DS, or Draco for glTF files that name its extension. Returns false for a file that cannot be read.
bool isReadByOthers(const std::filesystem::path& file);

/// Tells whether a file's name ends as the names of mesh files that `importMesh` reads.
bool isMeshFileName(const std::filesystem::path& file);

/// Returns the mesh of a built-in shape (`shapes::mesh`) if the name starts with `builtin:`, else the mesh of the file
/// with this name (`importMesh`).
TriangleMesh loadMesh(const std::string& fileOrShape, const Progress& progress = {});

/// Writes a mesh as OBJ, binary PLY, binary STL or GLB (binary glTF 2.0), depending on the file's extension. OBJ and
/// PLY keep coordinates in full double precision; STL and GLB hold single-precision numbers, and STL no data of
/// vertices. Coordinates keep their axes, also in GLB, where other programs take y for upward. Colours are sRGB in all
/// files but GLB, which holds them in linear light.
///
/// The file appears whole or not at all. Throws `Error` (of the kind `file`) for another extension, for vertices of
/// different positions that single precision cannot tell apart, and as `OutputFile` does.
void saveMesh(const TriangleMesh& mesh, const std::filesystem::path& file, const VertexData& data = {});

/// Passes the bytes of a binary PLY file with this mesh to `write`, in pieces. Allocates less than 100 kB.
void writePly(const TriangleMesh& mesh, const std::function<void(std::span<const std::byte>)>& write);

/// Tells whether a mesh file with this name would hold single-precision numbers: STL and GLB.
bool isSinglePrecisionMesh(const std::filesystem::path& file);

/// Tells whether a mesh file with this name would hold `VertexData`: all but STL.
bool holdsVertexData(const std::filesystem::path& file);

/// Throws the `Error` that `saveMesh` would throw for this file, as far as it can be foreseen. A caller thus learns
/// before long work that it could not write the file.
void checkMeshWritable(const std::filesystem::path& file);

}  // namespace hpsdf
