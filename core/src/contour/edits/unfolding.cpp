#include <algorithm>
#include <array>
#include <optional>

#include "contour/cells/triangle_errors.h"
#include "contour/edits/edge_collapse.h"
#include "contour/edits/edge_flip.h"
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

/// Returns attempt number `attempt` to turn over a triangle.
std::optional<Edit> unfoldingOf(const MeshEditor& editor, std::uint32_t triangle, int attempt) {
  const EditedMesh& mesh = editor.mesh();
  const Triangle& t = mesh.triangles()[triangle];
  const std::array<std::size_t, 3> sides = sidesByLength(mesh, t);
  if (attempt == 0) return flipOf(mesh, triangle, sides[2]);
  if (attempt == 2) return flipOf(mesh, triangle, sides[1]);
  std::optional<Edit> collapse = collapseOf(mesh, t[sides[0]], t[(sides[0] + 1) % 3]);
  if (collapse) placeVertex(editor.surface(), editor.limits(), *collapse);
  return collapse;
}

}  // namespace

void unfold(MeshEditor& editor) {
  constexpr int kAttempts = 3, kMostRounds = 10;
  int failures = 0;
  for (int round = 0; round < kMostRounds * kAttempts && failures < kAttempts; ++round) {
    const std::vector<double> cosines = editor.cosines();
    std::vector<Edit> edits;
    for (std::uint32_t n = 0; n < cosines.size(); ++n)
      if (cosines[n] < kFolded)
        if (auto edit = unfoldingOf(editor, n, round % kAttempts)) edits.push_back(std::move(*edit));
    std::vector<Edit> chosen;
    for (const std::size_t i : editor.independent(edits)) chosen.push_back(edits[i]);
    const bool isAnyMade = !chosen.empty() && std::ranges::count(editor.make(chosen), true) > 0;
    failures = isAnyMade ? 0 : failures + 1;
  }
}

}  // namespace hpsdf::contouring
