#include <algorithm>
#include <array>
#include <optional>

#include "contour/cells/triangle_errors.h"
#include "contour/edits/edge_collapse.h"
#include "contour/edits/improvement.h"

namespace hpsdf::contouring {
namespace {

/// The sides of a triangle by their lengths: number k is opposite to corner k + 2, between corners k and k + 1.
std::array<std::size_t, 3> sidesByLength(const EditedMesh& mesh, const Triangle& triangle) {
  std::array<std::size_t, 3> sides = {0, 1, 2};
  std::ranges::sort(sides, {}, [&](std::size_t k) {
    return (mesh.vertices()[triangle[(k + 1) % 3]] - mesh.vertices()[triangle[k]]).squaredNorm();
  });
  return sides;
}

/// Returns the replacement of a side by the other diagonal of the quadrilateral of both triangles at it, or
/// std::nullopt if the mesh has an edge there already, or only one triangle at the side.
std::optional<Edit> flipOf(const EditedMesh& mesh, std::uint32_t triangle, std::size_t side) {
  const Triangle& t = mesh.triangles()[triangle];
  const std::uint32_t a = t[side], b = t[(side + 1) % 3], c = t[(side + 2) % 3];
  std::optional<std::uint32_t> neighbor;
  for (const std::uint32_t n : mesh.trianglesAt(a)) {
    const Triangle& other = mesh.triangles()[n];
    if (n == triangle || std::ranges::find(other, b) == other.end()) continue;
    if (neighbor) return std::nullopt;
    neighbor = n;
  }
  if (!neighbor) return std::nullopt;
  const Triangle& other = mesh.triangles()[*neighbor];
  const std::uint32_t d = *std::ranges::find_if(other, [&](std::uint32_t v) { return v != a && v != b; });
  for (const std::uint32_t n : mesh.trianglesAt(c))
    if (std::ranges::find(mesh.triangles()[n], d) != mesh.triangles()[n].end()) return std::nullopt;
  return Edit{.removed = {triangle, *neighbor}, .added = {{a, d, c}, {d, b, c}}, .vertex = {}};
}

/// Returns attempt number `attempt` to turn over a triangle.
std::optional<Edit> unfoldingOf(const ImplicitSurface& surface, const EditLimits& limits, const EditedMesh& mesh,
                                std::uint32_t triangle, int attempt) {
  const Triangle& t = mesh.triangles()[triangle];
  const std::array<std::size_t, 3> sides = sidesByLength(mesh, t);
  if (attempt == 0) return flipOf(mesh, triangle, sides[2]);
  if (attempt == 1) return collapseOf(surface, limits, mesh, t[sides[0]], t[(sides[0] + 1) % 3]);
  return flipOf(mesh, triangle, sides[1]);
}

}  // namespace

void unfold(const ImplicitSurface& surface, const EditLimits& limits, const Progress& progress, EditedMesh& mesh) {
  constexpr int kAttempts = 3, kMostRounds = 10;
  MeshEditor editor(surface, limits, progress, mesh);
  int failures = 0;
  for (int round = 0; round < kMostRounds * kAttempts && failures < kAttempts; ++round) {
    const std::vector<double> cosines = editor.cosines();
    std::vector<Edit> edits;
    for (std::uint32_t n = 0; n < cosines.size(); ++n)
      if (cosines[n] < kFolded)
        if (auto edit = unfoldingOf(surface, limits, mesh, n, round % kAttempts)) edits.push_back(std::move(*edit));
    std::vector<Edit> chosen;
    for (const std::size_t i : editor.independent(edits)) chosen.push_back(edits[i]);
    const bool isAnyMade = !chosen.empty() && std::ranges::count(editor.make(chosen), true) > 0;
    failures = isAnyMade ? 0 : failures + 1;
  }
}

}  // namespace hpsdf::contouring
