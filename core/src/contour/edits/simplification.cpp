#include <algorithm>
#include <cstdint>

#include "contour/edits/edge_collapse.h"
#include "contour/edits/improvement.h"
#include "mesh/connectivity.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

/// An edge whose ends may be merged.
struct Candidate {
  std::uint64_t edge;    ///< as in mesh::DirectedEdge
  double cost = 0;       ///< as in MergedVertex
  bool isTried = false;  ///< merging was tried, and the mesh around is as it was then

  std::uint32_t low() const { return static_cast<std::uint32_t>(edge >> 32); }
  std::uint32_t high() const { return static_cast<std::uint32_t>(edge); }
};

/// Merges vertices in rounds: in each, edges with low costs that have nothing to do with each other.
class Simplification {
 public:
  explicit Simplification(MeshEditor& editor) : editor_(editor), mesh_(editor.mesh()) {}

  void run() {
    constexpr int kMostPoorRounds = 5;
    constexpr std::size_t kPoor = 2000;  // a round is poor that merges fewer than one vertex for so many triangles
    isChanged_.assign(mesh_.vertices().size(), true);
    for (int poor = 0; poor < kMostPoorRounds;) {
      updateCandidates();
      const std::vector<std::size_t> cheapest = cheapestCandidates();
      if (cheapest.empty()) return;
      const auto tried = std::ranges::count_if(candidates_, &Candidate::isTried);
      editor_.progress().update("merging vertices", double(tried) / double(candidates_.size()));
      const std::size_t merged = tryToMerge(cheapest);
      poor = merged < mesh_.triangles().size() / kPoor ? poor + 1 : 0;
    }
  }

 private:
  /// Lists the edges of the mesh. Costs and trials of those whose surroundings have not changed are kept.
  void updateCandidates() {
    constexpr std::size_t kAtOnce = 256;
    const std::vector<mesh::DirectedEdge> sides = mesh::directedEdgesOf(mesh_.triangles());
    std::vector<Candidate> all;
    std::vector<std::size_t> fresh;
    auto old = candidates_.begin();
    mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> side) {
      Candidate candidate{.edge = side[0].edge};
      while (old != candidates_.end() && old->edge < candidate.edge) ++old;
      if (old != candidates_.end() && old->edge == candidate.edge && !isChanged_[candidate.low()] &&
          !isChanged_[candidate.high()])
        candidate = *old;
      else
        fresh.push_back(all.size());
      all.push_back(candidate);
    });
    candidates_ = std::move(all);
    detail::forEachChunk(fresh.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
      for (std::size_t i = first; i < first + count; ++i) {
        Candidate& candidate = candidates_[fresh[i]];
        candidate.cost = mergedVertex(mesh_, candidate.low(), candidate.high()).cost;
      }
    });
    isChanged_.assign(mesh_.vertices().size(), false);
  }

  /// Returns candidates that have not been tried, by their costs: a part of all, so that the flattest places come
  /// first.
  std::vector<std::size_t> cheapestCandidates() const {
    constexpr std::size_t kPart = 3, kLeast = 4096;
    const double dearest = 2 * editor_.limits().tolerance;
    std::vector<std::size_t> cheapest;
    for (std::size_t i = 0; i < candidates_.size(); ++i)
      if (!candidates_[i].isTried && candidates_[i].cost <= dearest) cheapest.push_back(i);
    std::ranges::sort(cheapest, {}, [&](std::size_t i) { return std::pair(candidates_[i].cost, i); });
    cheapest.resize(std::min(cheapest.size(), std::max(cheapest.size() / kPart, kLeast)));
    return cheapest;
  }

  /// Returns how many were merged.
  std::size_t tryToMerge(std::span<const std::size_t> cheapest) {
    constexpr std::size_t kAtOnce = 64;
    std::vector<std::optional<Edit>> found(cheapest.size());
    detail::forEachChunk(found.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
      editor_.progress().throwIfCancelled();
      for (std::size_t i = first; i < first + count; ++i)
        found[i] = collapseOf(mesh_, candidates_[cheapest[i]].low(), candidates_[cheapest[i]].high());
    });
    std::vector<Edit> edits;
    std::vector<std::size_t> candidateOf;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (!found[i]) {
        candidates_[cheapest[i]].isTried = true;
        continue;
      }
      edits.push_back(std::move(*found[i]));
      candidateOf.push_back(cheapest[i]);
    }
    std::vector<Edit> chosen;
    for (const std::size_t i : editor_.independent(edits)) {
      candidates_[candidateOf[i]].isTried = true;
      chosen.push_back(std::move(edits[i]));
    }
    detail::forEachChunk(chosen.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
      for (Edit& edit : std::span(chosen).subspan(first, count)) placeVertex(editor_.surface(), editor_.limits(), edit);
    });
    std::vector<std::vector<std::uint32_t>> around;
    for (const Edit& edit : chosen) around.push_back(verticesAround(edit));
    const std::vector<bool> isMade = editor_.make(chosen);
    for (std::size_t i = 0; i < chosen.size(); ++i)
      for (const std::uint32_t vertex : around[i])
        if (isMade[i]) isChanged_[vertex] = true;
    return static_cast<std::size_t>(std::ranges::count(isMade, true));
  }

  std::vector<std::uint32_t> verticesAround(const Edit& edit) const {
    std::vector<std::uint32_t> vertices;
    for (const std::uint32_t n : edit.removed)
      vertices.insert(vertices.end(), mesh_.triangles()[n].begin(), mesh_.triangles()[n].end());
    return vertices;
  }

  MeshEditor& editor_;
  const EditedMesh& mesh_;
  std::vector<Candidate> candidates_;  ///< sorted by their edges
  std::vector<bool> isChanged_;        ///< by vertex: triangles at it have changed in the last round
};

}  // namespace

void simplify(MeshEditor& editor) { Simplification(editor).run(); }

}  // namespace hpsdf::contouring
