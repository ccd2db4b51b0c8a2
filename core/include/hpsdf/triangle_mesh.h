#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf {

/// Beyond this, squares and volumes leave the range of double.
constexpr double kLargestCoordinate = 1e100;

/// Vertices in mesh units; triangles index them, counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Vector3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::string name;  ///< for messages and the field's metadata: the file's name without its path, or the shape's spec
};

/// Throws `Error`, naming mesh, triangle and vertex, for the first triangle that refers to a vertex which does not
/// exist.
void requireValidIndices(const TriangleMesh& mesh);

/// Smallest box around the vertices that triangles use. Empty for a mesh without triangles.
Box boundingBox(const TriangleMesh& mesh);

/// Signed volume by the divergence theorem, in cubed mesh units; positive when the faces look outward.
double signedVolume(const TriangleMesh& mesh);

/// Sum of the triangles' areas.
double surfaceArea(const TriangleMesh& mesh);

/// 64-bit hash of vertices and triangles, the same on every machine. The name does not count.
std::uint64_t fingerprint(const TriangleMesh& mesh);

/// What takes a surface with this box into [-1, 1]³. Throws `Error` for one without finite extent.
Normalization normalizing(const Box& surface);

/// The mesh scaled uniformly and centred so that the longest side of its box spans exactly [-1, 1], as the paper does.
/// Throws `Error` for a mesh without extent.
TriangleMesh normalized(const TriangleMesh& mesh);

}  // namespace hpsdf
