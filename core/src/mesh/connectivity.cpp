#include "mesh/connectivity.h"

#include <tbb/parallel_sort.h>

#include <array>
#include <utility>

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
  std::vector<DirectedEdge> edges;
  edges.reserve(3 * triangles.size());
  for (std::size_t f = 0; f < triangles.size(); ++f)
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t from = triangles[f][i], to = triangles[f][(i + 1) % 3];
      if (from == to) continue;
      const auto [low, high] = std::minmax(from, to);
      edges.push_back({std::uint64_t{low} << 32 | high, static_cast<std::uint32_t>(f), from < to});
    }
  tbb::parallel_sort(edges.begin(), edges.end(), [](const DirectedEdge& a, const DirectedEdge& b) {
    return std::pair(a.edge, a.face) < std::pair(b.edge, b.face);
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
