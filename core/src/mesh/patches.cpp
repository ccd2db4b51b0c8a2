#include "mesh/patches.h"

#include <array>

namespace hpsdf {
namespace {

/// The faces across a face's edges of two faces.
struct Neighbours {
  std::array<std::uint32_t, 3> face;
  std::array<char, 3> sameWay;  ///< 1 where both run the same way along the edge: they look different ways
  std::uint8_t count = 0;

  void add(std::uint32_t other, bool same) {
    face[count] = other;
    sameWay[count++] = same;
  }
};

}  // namespace

FaceSets partsOf(std::size_t faces, std::span<const Side> sides) {
  FaceSets parts(faces);
  forEachEdge(sides, [&](std::span<const Side> edge) {
    for (const Side& side : edge) parts.join(edge.front().face, side.face);
  });
  return parts;
}

Patches patchesOf(std::size_t faces, std::span<const Side> sides) {
  std::vector<Neighbours> neighbours(faces);
  forEachEdge(sides, [&](std::span<const Side> edge) {
    if (edge.size() != 2 || edge[0].face == edge[1].face) return;
    const bool sameWay = edge[0].rising == edge[1].rising;
    neighbours[edge[0].face].add(edge[1].face, sameWay);
    neighbours[edge[1].face].add(edge[0].face, sameWay);
  });

  constexpr std::uint32_t kNone = 0xffffffff;
  Patches patches{
      .of = std::vector<std::uint32_t>(faces, kNone), .against = std::vector<char>(faces, 0), .oneSided = {}};
  std::vector<std::uint32_t> pending;
  for (std::uint32_t lowest = 0; lowest < faces; ++lowest) {
    if (patches.of[lowest] != kNone) continue;
    const auto patch = static_cast<std::uint32_t>(patches.count++);
    patches.oneSided.push_back(0);
    patches.of[lowest] = patch;
    pending.push_back(lowest);
    while (!pending.empty()) {
      const std::uint32_t face = pending.back();
      pending.pop_back();
      const Neighbours& across = neighbours[face];
      for (int i = 0; i < across.count; ++i) {
        const std::uint32_t other = across.face[i];
        const auto against = static_cast<char>(patches.against[face] ^ across.sameWay[i]);
        if (patches.of[other] == kNone) {
          patches.of[other] = patch;
          patches.against[other] = against;
          pending.push_back(other);
        } else if (patches.against[other] != against) {
          patches.oneSided[patch] = 1;
        }
      }
    }
  }
  return patches;
}

}  // namespace hpsdf
