#include "hpsdf/triangle_mesh.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <cmath>
#include <span>

#include "hpsdf/error.h"
#include "mesh/mesh_fingerprint.h"
#include "util/refuse.h"

namespace hpsdf {
namespace {

/// Returns the longest side of the bounding box of a surface. Throws an `Error` that names `subject` if this side
/// is 0 or not finite.
double longestSide(const Box& surface, const std::string& subject) {
  const double longest = surface.isEmpty() ? 0 : surface.sizes().maxCoeff();
  if (!(longest > 0) || !std::isfinite(longest))
    throw Error(ErrorKind::mesh, subject,
                "the surface cannot be normalized, for it has no finite extent; check its vertices");
  return longest;
}

}  // namespace

void requireValidIndices(const std::string& name, std::size_t index, const Triangle& triangle, std::size_t vertices) {
  for (const std::uint32_t v : triangle)
    if (v >= vertices)
      detail::refuseMesh(name, "face ", index + 1, " refers to vertex ", std::uint64_t{v} + 1, ", but there are only ",
                         vertices, "; repair or export the mesh again");
}

void requireValidIndices(const TriangleMesh& mesh) {
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    requireValidIndices(mesh.name, f, mesh.triangles[f], mesh.vertices.size());
}

Box boundingBox(const TriangleMesh& mesh) {
  using Range = tbb::blocked_range<std::size_t>;
  return tbb::parallel_reduce(
      Range(0, mesh.triangles.size(), 10'000), Box(),
      [&](const Range& range, Box box) {
        for (std::size_t t = range.begin(); t < range.end(); ++t)
          for (const std::uint32_t v : mesh.triangles[t]) box.extend(mesh.vertices[v]);
        return box;
      },
      [](const Box& a, const Box& b) { return a.merged(b); });
}

double signedVolume(const TriangleMesh& mesh) {
  const Box box = boundingBox(mesh);
  if (box.isEmpty()) return 0;
  // The volume is the sum of the signed volumes of the tetrahedra between the triangles and a common apex. For a
  // closed mesh it does not depend on the apex. With the box's centre as apex, the terms stay small, so that a
  // mesh far from the origin loses no digits by cancellation.
  const Vector3 apex = box.center();
  double six = 0;
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    six += (a - apex).dot((b - apex).cross(c - apex));
  }
  return six / 6;
}

double surfaceArea(const TriangleMesh& mesh) {
  double twice = 0;
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    twice += (b - a).cross(c - a).norm();
  }
  return twice / 2;
}

std::uint64_t fingerprint(const TriangleMesh& mesh) {
  mesh::MeshFingerprint fingerprint(mesh.vertices.size(), mesh.triangles.size());
  for (const Vector3& vertex : mesh.vertices) fingerprint.add(vertex);
  fingerprint.add(mesh.triangles);
  return fingerprint.value();
}

Normalization normalizationOf(const Box& surface) { return {surface.center(), 2 / longestSide(surface, "")}; }

TriangleMesh normalized(const TriangleMesh& mesh) {
  requireValidIndices(mesh);
  const Box box = boundingBox(mesh);
  const double longest = longestSide(box, mesh.name.empty() ? "mesh" : mesh.name);
  TriangleMesh result = mesh;
  if (normalizationOf(box).isIdentity()) return result;  // not even rounded, so that a field's mesh is found again
  // (x - min) - (max - x) equals 2(x - centre) but avoids rounding the centre. Along the longest side of the box it is
  // exactly -longest at min and +longest at max, and it never decreases with x. Therefore no vertex leaves [-1, 1].
  for (Vector3& v : result.vertices) v = ((v - box.min()) - (box.max() - v)) / longest;
  return result;
}

}  // namespace hpsdf
