#include "mesh/connectivity.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

namespace hpsdf::mesh {
namespace {

/// The neighbours of a triangle across edges that no third triangle shares.
struct Neighbours {
  std::array<std::uint32_t, 3> face;
  std::array<char, 3> sameDirection;  ///< 1 if both triangles traverse the edge in the same direction (inconsistent)
  std::uint8_t count = 0;

  void add(std::uint32_t other, bool same) {
    face[count] = other;
    sameDirection[count++] = same;
  }
};

std::vector<Neighbours> neighboursOf(std::size_t faces, std::span<const DirectedEdge> edges) {
  std::vector<Neighbours> neighbours(faces);
  forEachEdge(edges, [&](std::span<const DirectedEdge> edge) {
    if (edge.size() != 2 || edge[0].face == edge[1].face) return;
    const bool sameDirection = edge[0].rising == edge[1].rising;
    neighbours[edge[0].face].add(edge[1].face, sameDirection);
    neighbours[edge[1].face].add(edge[0].face, sameDirection);
  });
  return neighbours;
}

constexpr std::uint32_t kNone = 0xffffffff;

/// Adds to `patches` the patch of the triangle `lowest`: all triangles that can be reached from `lowest` across edges
/// of exactly two triangles. `pending` is scratch memory.
void addPatch(std::uint32_t lowest, std::span<const Neighbours> neighbours, Patches& patches,
              std::vector<std::uint32_t>& pending) {
  const auto patch = static_cast<std::uint32_t>(patches.count++);
  patches.oneSided.push_back(0);
  patches.patchOf[lowest] = patch;
  pending.push_back(lowest);
  while (!pending.empty()) {
    const std::uint32_t face = pending.back();
    pending.pop_back();
    const Neighbours& across = neighbours[face];
    for (int i = 0; i < across.count; ++i) {
      const std::uint32_t other = across.face[i];
      const auto against = static_cast<char>(patches.against[face] ^ across.sameDirection[i]);
      if (patches.patchOf[other] == kNone) {
        patches.patchOf[other] = patch;
        patches.against[other] = against;
        pending.push_back(other);
      } else if (patches.against[other] != against) {
        patches.oneSided[patch] = 1;
      }
    }
  }
}

}  // namespace

std::vector<DirectedEdge> directedEdgesOf(std::span<const Triangle> triangles) {
  std::uint32_t highest = 0;
  for (const Triangle& triangle : triangles) highest = std::max(highest, std::ranges::max(triangle));
  const auto forEach = [&](const auto& visit) {
    for (std::size_t f = 0; f < triangles.size(); ++f)
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t from = triangles[f][i], to = triangles[f][(i + 1) % 3];
        const auto [low, high] = std::minmax(from, to);
        if (from != to) visit(DirectedEdge{std::uint64_t{low} << 32 | high, std::uint32_t(f), from < to});
      }
  };
  // A counting sort by the lower vertex, in linear time, leaves a few edges at each vertex to be sorted.
  std::vector<std::size_t> ends(std::size_t{highest} + 2);
  forEach([&](const DirectedEdge& edge) { ++ends[edge.low() + 1]; });
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  std::vector<DirectedEdge> edges(ends.back());
  forEach([&](const DirectedEdge& edge) { edges[ends[edge.low()]++] = edge; });
  constexpr std::size_t kVerticesATask = 4096;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, ends.size() - 1, kVerticesATask), [&](const auto& range) {
    for (std::size_t v = range.begin(); v < range.end(); ++v)
      std::sort(edges.begin() + std::ptrdiff_t(v == 0 ? 0 : ends[v - 1]), edges.begin() + std::ptrdiff_t(ends[v]),
                [](const DirectedEdge& one, const DirectedEdge& other) {
                  return std::tuple(one.edge, one.face, one.rising) < std::tuple(other.edge, other.face, other.rising);
                });
  });
  return edges;
}

DisjointSets componentsOf(std::size_t faces, std::span<const DirectedEdge> edges) {
  DisjointSets components(faces);
  forEachEdge(edges, [&](std::span<const DirectedEdge> edge) {
    for (const DirectedEdge& other : edge) components.join(edge.front().face, other.face);
  });
  return components;
}

Patches patchesOf(std::size_t faces, std::span<const DirectedEdge> edges) {
  const std::vector<Neighbours> neighbours = neighboursOf(faces, edges);
  Patches patches{
      .patchOf = std::vector<std::uint32_t>(faces, kNone), .against = std::vector<char>(faces, 0), .oneSided = {}};
  std::vector<std::uint32_t> pending;
  for (std::uint32_t lowest = 0; lowest < faces; ++lowest)
    if (patches.patchOf[lowest] == kNone) addPatch(lowest, neighbours, patches, pending);
  return patches;
}

}  // namespace hpsdf::mesh
