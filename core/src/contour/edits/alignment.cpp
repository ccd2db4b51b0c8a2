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

/// Returns flips of edges of those of some triangles that are open, by which the middle comes much nearer to the
/// surface.
std::vector<ProposedFlip> flipsOf(const MeshEditor& editor, const std::vector<bool>& isOpen, std::size_t first,
                                  std::size_t count) {
  constexpr double kFar = 0.1;     // least value in the middle of an edge that may be flipped, in tolerances
  constexpr double kNearer = 0.3;  // greatest value in the middle of the other diagonal, as a part of that
  const EditedMesh& mesh = editor.mesh();
  std::vector<std::pair<std::uint32_t, std::size_t>> sides;
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (auto n = static_cast<std::uint32_t>(first); n < first + count; ++n)
    for (std::size_t side = 0; side < 3 && isOpen[n]; ++side) {
      const std::uint32_t a = mesh.triangles()[n][side], b = mesh.triangles()[n][(side + 1) % 3];
      const std::optional<std::uint32_t> neighbor = neighborOf(mesh, n, side);
      if (!neighbor || (a > b && isOpen[*neighbor])) continue;  // one triangle of two proposes to flip their edge
      sides.emplace_back(n, side);
      edges.push_back({a, b});
    }
  const std::vector<double> before = valuesInMiddles(editor.surface(), mesh, edges);
  std::vector<ProposedFlip> flips;
  edges.clear();
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (before[i] < kFar * editor.limits().tolerance) continue;
    std::optional<Edit> flip = flipOf(mesh, sides[i].first, sides[i].second);
    if (!flip) continue;
    edges.push_back({flip->added[0][1], flip->added[0][2]});
    flips.push_back({std::move(*flip), before[i]});
  }
  const std::vector<double> after = valuesInMiddles(editor.surface(), mesh, edges);
  std::vector<ProposedFlip> nearer;
  for (std::size_t i = 0; i < flips.size(); ++i)
    if (after[i] < kNearer * flips[i].value) nearer.push_back(std::move(flips[i]));
  return nearer;
}

}  // namespace

void align(MeshEditor& editor) {
  constexpr int kMostRounds = 4;
  constexpr std::size_t kAtOnce = 256;
  std::vector<bool> isOpen(editor.mesh().triangles().size(), true);  // it is not known that no edge is to be flipped
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<ProposedFlip> proposed = detail::listOfChunks<ProposedFlip>(
        isOpen.size(), kAtOnce, Progress{.cancelled = editor.progress().cancelled}, "",
        [&](std::vector<ProposedFlip>& found, std::size_t first, std::size_t count) {
          found = flipsOf(editor, isOpen, first, count);
        });
    std::ranges::stable_sort(proposed, std::greater{}, &ProposedFlip::value);
    std::vector<Edit> flips, chosen;
    for (ProposedFlip& one : proposed) flips.push_back(std::move(one.flip));
    const std::vector<std::size_t> independent = editor.independent(flips);
    for (const std::size_t i : independent) chosen.push_back(flips[i]);
    if (chosen.empty()) return;
    const std::vector<bool> isMade = editor.make(chosen);
    // A flip that was refused is not proposed again unless a triangle beside its edge changes, or is at another edge of
    // which the flip was not tried.
    std::vector<bool> isRefused(flips.size());
    for (std::size_t i = 0; i < chosen.size(); ++i) isRefused[independent[i]] = !isMade[i];
    isOpen.assign(isOpen.size(), false);
    for (std::size_t i = 0; i < flips.size(); ++i)
      for (const std::uint32_t n : flips[i].removed) isOpen[n] = isOpen[n] || !isRefused[i];
  }
}

}  // namespace hpsdf::contouring
