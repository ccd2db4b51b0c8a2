#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf {

/// The greatest absolute coordinate of a mesh: beyond it, squares and volumes leave the range of double.
constexpr double kLargestCoordinate = 1e100;

/// The vertices of a triangle, counter-clockwise as seen from outside.
using Triangle = std::array<std::uint32_t, 3>;

/// Vertices in mesh units, and triangles that index them.
struct TriangleMesh {
  std::vector<Vector3> vertices;
  std::vector<Triangle> triangles;
  std::string name;  ///< the file's name without its path, or the shape's spec; for messages and metadata
};

/// The positions of a triangle's vertices.
inline std::array<Vector3, 3> cornersOf(const TriangleMesh& mesh, const Triangle& triangle) {
  return {mesh.vertices[triangle[0]], mesh.vertices[triangle[1]], mesh.vertices[triangle[2]]};
}

/// Throws `Error` (mesh) for the first triangle that refers to a vertex which does not exist.
void requireValidIndices(const TriangleMesh& mesh);

/// Smallest box around the vertices that triangles use; empty for a mesh without triangles.
Box boundingBox(const TriangleMesh& mesh);

/// Signed volume by the divergence theorem, in cubed mesh units; positive when the triangles face outward.
double signedVolume(const TriangleMesh& mesh);

/// Sum of the triangles' areas, in squared mesh units.
double surfaceArea(const TriangleMesh& mesh);

/// 64-bit XXH3 hash of vertices and triangles, the same on every machine. The name has no influence.
std::uint64_t fingerprint(const TriangleMesh& mesh);

/// The normalization that maps a surface with this box into [-1, 1]³. Throws `Error` (mesh) for a box without finite
/// extent.
Normalization normalizationOf(const Box& surface);

/// The mesh scaled uniformly and centred so that the longest side of its box spans exactly [-1, 1] (Koschier et al.
/// 2016, sec. 4). Throws `Error` (mesh) for a mesh without finite extent.
TriangleMesh normalized(const TriangleMesh& mesh);

}  // namespace hpsdf
