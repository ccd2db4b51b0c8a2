#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf {

/// The greatest allowed absolute coordinate of a mesh. Beyond it, squared lengths and volumes would leave the
/// range of double.
constexpr double kLargestCoordinate = 1e100;

/// The indices of a triangle's three vertices, counter-clockwise as seen from outside.
using Triangle = std::array<std::uint32_t, 3>;

/// The part of a triangle on which the closest point to a query lies.
enum class Feature : std::uint8_t { face, edge, vertex };

/// A mesh: vertices in mesh units, and triangles that refer to the vertices by index.
struct TriangleMesh {
  std::vector<Vector3> vertices;
  std::vector<Triangle> triangles;
  std::string name;  ///< the file's name without its path, or a shape's specification; for messages and metadata
};

/// Data of vertices that is written with a mesh. Each list is empty or has one entry for each vertex.
struct VertexData {
  std::span<const Vector3> normals = {};                     ///< unit vectors
  std::span<const std::array<std::uint8_t, 3>> colors = {};  ///< red, green, blue (sRGB)
};

/// Returns the positions of the three vertices of a triangle.
inline std::array<Vector3, 3> cornersOf(const TriangleMesh& mesh, const Triangle& triangle) {
  return {mesh.vertices[triangle[0]], mesh.vertices[triangle[1]], mesh.vertices[triangle[2]]};
}

/// Throws `Error` (of the kind `mesh`) if a triangle refers to a vertex that does not exist. The message names the
/// first such triangle.
void requireValidIndices(const TriangleMesh& mesh);
/// Throws this `Error` for one triangle, with this index, of the mesh `name`, which has so many vertices.
void requireValidIndices(const std::string& name, std::size_t index, const Triangle& triangle, std::size_t vertices);

/// Returns the smallest box around the vertices that triangles use. The box is empty for a mesh without
/// triangles.
Box boundingBox(const TriangleMesh& mesh);

/// Returns the signed volume of a mesh by the divergence theorem, in cubed mesh units. It is positive if the
/// triangles face outward.
double signedVolume(const TriangleMesh& mesh);

/// Returns the sum of the areas of all triangles, in squared mesh units.
double surfaceArea(const TriangleMesh& mesh);

/// Returns the 64-bit XXH3 hash of a mesh's vertices and triangles, which is the same on every machine. The
/// name of the mesh does not influence the hash.
std::uint64_t fingerprint(const TriangleMesh& mesh);

/// Returns the normalization that maps a surface with this bounding box into [-1, 1]³. Throws `Error` (of the kind
/// `mesh`) for a box without finite extent.
Normalization normalizationOf(const Box& surface);

/// Returns a copy of the mesh, scaled uniformly and centred so that the longest side of its bounding box spans exactly
/// [-1, 1] (Koschier et al. 2016, sec. 4). Throws `Error` (of the kind `mesh`) for a mesh without finite extent.
TriangleMesh normalized(const TriangleMesh& mesh);

}  // namespace hpsdf
