#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "contour/edits/edge_flip.h"
#include "contour/edits/improvement.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

/// A flip, and how far the middle of the edge before it is from the surface.
struct ProposedFlip {
  Edit flip;
  double value;
};

/// Returns the magnitudes of the function in the middles of edges, which are given by their ends.
std::vector<double> valuesInMiddles(const ImplicitSurface& surface, const EditedMesh& mesh,
                                    std::span<const std::array<std::uint32_t, 2>> edges) {
  std::vector<Vector3> middles;
  for (const auto& [a, b] : edges) middles.emplace_back((mesh.vertices()[a] + mesh.vertices()[b]) / 2);
  std::vector<double> values(middles.size());
  surface.values(middles, values);
  for (double& value : values) value = std::abs(value);
  return values;
}

/// Returns flips of edges of some triangles, by which the middle comes much nearer to the surface.
std::vector<ProposedFlip> flipsOf(const ImplicitSurface& surface, const EditLimits& limits, const EditedMesh& mesh,
                                  std::size_t first, std::size_t count) {
  constexpr double kFar = 0.1;     // least value in the middle of an edge that may be flipped, in tolerances
  constexpr double kNearer = 0.3;  // greatest value in the middle of the other diagonal, as a part of that
  std::vector<std::pair<std::uint32_t, std::size_t>> sides;
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (std::size_t n = first; n < first + count; ++n)
    for (std::size_t side = 0; side < 3; ++side) {
      const std::uint32_t a = mesh.triangles()[n][side], b = mesh.triangles()[n][(side + 1) % 3];
      if (a > b) continue;  // the other triangle at the edge has it
      sides.emplace_back(static_cast<std::uint32_t>(n), side);
      edges.push_back({a, b});
    }
  const std::vector<double> before = valuesInMiddles(surface, mesh, edges);
  std::vector<ProposedFlip> flips;
  edges.clear();
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (before[i] < kFar * limits.tolerance) continue;
    std::optional<Edit> flip = flipOf(mesh, sides[i].first, sides[i].second);
    if (!flip) continue;
    edges.push_back({flip->added[0][1], flip->added[0][2]});
    flips.push_back({std::move(*flip), before[i]});
  }
  const std::vector<double> after = valuesInMiddles(surface, mesh, edges);
  std::vector<ProposedFlip> nearer;
  for (std::size_t i = 0; i < flips.size(); ++i)
    if (after[i] < kNearer * flips[i].value) nearer.push_back(std::move(flips[i]));
  return nearer;
}

}  // namespace

void align(MeshEditor& editor) {
  constexpr int kMostRounds = 4;
  constexpr std::size_t kAtOnce = 256;
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<ProposedFlip> proposed = detail::listOfChunks<ProposedFlip>(
        editor.mesh().triangles().size(), kAtOnce, {}, "",
        [&](std::vector<ProposedFlip>& found, std::size_t first, std::size_t count) {
          found = flipsOf(editor.surface(), editor.limits(), editor.mesh(), first, count);
        });
    std::ranges::stable_sort(proposed, std::greater{}, &ProposedFlip::value);
    std::vector<Edit> flips, chosen;
    for (ProposedFlip& one : proposed) flips.push_back(std::move(one.flip));
    for (const std::size_t i : editor.independent(flips)) chosen.push_back(std::move(flips[i]));
    if (chosen.empty() || std::ranges::count(editor.make(chosen), true) == 0) return;
  }
}

}  // namespace hpsdf::contouring
