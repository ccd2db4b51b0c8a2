#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

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

std::vector<std::uint32_t> foldedTriangles(const MeshEditor& editor) {
  const std::vector<double> cosines = editor.cosines();
  std::vector<std::uint32_t> folded;
  for (std::uint32_t n = 0; n < cosines.size(); ++n)
    if (cosines[n] < kFolded) folded.push_back(n);
  return folded;
}

constexpr int kAttempts = 5;

/// Returns attempt number `attempt` of kAttempts to turn over a triangle: the flip of one of its longer sides, or
/// the collapse of a side.
std::optional<Edit> unfoldingOf(const MeshEditor& editor, std::uint32_t triangle, int attempt) {
  const EditedMesh& mesh = editor.mesh();
  const Triangle& t = mesh.triangles()[triangle];
  const std::array<std::size_t, 3> sides = sidesByLength(mesh, t);
  const auto collapseOfSide = [&](std::size_t side) {
    std::optional<Edit> collapse = collapseOf(mesh, t[side], t[(side + 1) % 3]);
    if (collapse) placeVertex(editor.surface(), editor.limits(), *collapse);
    return collapse;
  };
  switch (attempt) {
    case 0:
      return flipOf(mesh, triangle, sides[2]);
    case 1:
      return collapseOfSide(sides[0]);
    case 2:
      return flipOf(mesh, triangle, sides[1]);
    case 3:
      return collapseOfSide(sides[1]);
    default:
      return collapseOfSide(sides[2]);
  }
}

}  // namespace

void unfold(MeshEditor& editor) {
  constexpr int kMostRounds = 10;
  std::vector<std::uint32_t> folded = foldedTriangles(editor);
  int failures = 0;
  for (int round = 0; round < kMostRounds * kAttempts && failures < kAttempts && !folded.empty(); ++round) {
    std::vector<Edit> edits, chosen;
    for (const std::uint32_t n : folded)
      if (auto edit = unfoldingOf(editor, n, round % kAttempts)) edits.push_back(std::move(*edit));
    for (const std::size_t i : editor.independent(edits)) chosen.push_back(std::move(edits[i]));
    const bool isAnyMade = !chosen.empty() && std::ranges::count(editor.make(chosen), true) > 0;
    failures = isAnyMade ? 0 : failures + 1;
    if (isAnyMade) folded = foldedTriangles(editor);
  }
}

}  // namespace hpsdf::contouring
