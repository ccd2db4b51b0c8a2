#include "distance/inside_test.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mesh/directed_edges.h"
#include "mesh/face_sets.h"
#include "surface/crossings.h"

namespace hpsdf::distance {
namespace {

constexpr int kLattice = 16;  // places along each axis
/// Of coordinates of order 1: of two triangles nearer than that, distances may round to be the same.
constexpr double kTooNear = 0x1p-44;
/// Of the sum of an edge's unit normals, the angle between its faces: above a face, beside such an edge, the product
/// that decides is half its square, which is to be far above what rounds.
constexpr double kSharp = 1e-6;

/// Whether an open mesh has an inside at any place of a lattice, which reaches beyond it, for it may be flat.
bool surroundsAny(const Inside& inside, const Box& mesh) {
  const Vector3 beyond = Vector3::Constant(0.1 * mesh.sizes().norm());
  const Box box(mesh.min() - beyond, mesh.max() + beyond);
  std::vector<Vector3> places;
  const Vector3 size = box.sizes();
  for (int z = 0; z < kLattice; ++z)
    for (int y = 0; y < kLattice; ++y)
      for (int x = 0; x < kLattice; ++x)
        places.push_back(box.min() + size.cwiseProduct((Vector3(x, y, z) + Vector3::Constant(0.5)) / kLattice));
  return std::ranges::count(inside.contains(places), 1) > 0;
}

/// The greatest triangle of each piece of the surface, by their slots.
std::vector<std::uint32_t> greatestOfPieces(const Hierarchy& hierarchy, const std::vector<Side>& sides) {
  const auto frames = hierarchy.frames();
  FaceSets pieces(frames.size());
  forEachEdge(sides, [&](std::span<const Side> edge) {
    if (edge.size() == 2 && edge[0].rising != edge[1].rising) pieces.join(edge[0].face, edge[1].face);
  });
  const auto area = [&](std::uint32_t slot) { return frames[slot].length * frames[slot].apexAcross; };
  std::vector<std::uint32_t> greatest(frames.size());
  for (std::uint32_t slot = 0; slot < frames.size(); ++slot) {
    const std::uint32_t first = pieces.first(slot);  // no later than this one
    if (first == slot || area(slot) > area(greatest[first])) greatest[first] = slot;
  }
  std::vector<std::uint32_t> slots;
  for (std::uint32_t slot = 0; slot < frames.size(); ++slot)
    if (pieces.first(slot) == slot) slots.push_back(greatest[slot]);
  return slots;
}

/// A place on a piece of the surface that has not the outside before it and the inside behind it.
std::optional<Vector3> misplaced(const Hierarchy& hierarchy, const std::vector<std::uint32_t>& pieces,
                                 const Inside& inside) {
  std::vector<char> wrong(pieces.size());
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t i) { wrong[i] = !inside.boundsInside(pieces[i]); });
  const auto first = std::ranges::find(wrong, 1);
  if (first == wrong.end()) return std::nullopt;
  return hierarchy.frames()[pieces[std::size_t(first - wrong.begin())]].origin;
}

/// The first corner where the pseudonormal of it, or of the edge from there, is next to nothing.
std::optional<Vector3> tooSharp(const Hierarchy& hierarchy, const Pseudonormals& normals) {
  const auto triangles = hierarchy.triangles();
  std::vector<char> sharp(triangles.size());
  tbb::parallel_for(std::size_t{0}, triangles.size(), [&](std::size_t slot) {
    for (std::uint32_t k = 0; k < 3; ++k)
      sharp[slot] |= normals.ofVertex(triangles[slot][k]).norm() < kSharp ||
                     normals.ofEdge(hierarchy, static_cast<std::uint32_t>(slot), k).norm() < kSharp;
  });
  const auto first = std::ranges::find(sharp, 1);
  if (first == sharp.end()) return std::nullopt;
  return hierarchy.frames()[std::size_t(first - sharp.begin())].origin;
}

}  // namespace

ChosenInsideTest chooseInsideTest(const Hierarchy& hierarchy, const TriangleMesh& mesh, const Progress& progress) {
  const auto byWinding = [](std::string reason, std::optional<Vector3> place, Inside inside) {
    return ChosenInsideTest{.choice = {InsideTest::winding, std::move(reason), place}, .inside = std::move(inside)};
  };
  const std::vector<Side> sides = sidesByEdge(hierarchy.triangles());
  BoundaryEdges rims(hierarchy, sides);
  if (const std::size_t open = rims.size(); open > 0) {
    Inside inside(hierarchy, mesh, std::move(rims));
    std::string reason = std::to_string(open) + (open == 1 ? " edge has" : " edges have");
    reason += " a side without a neighbour, and ";
    reason += surroundsAny(inside, boundingBox(mesh))
                  ? "holes are closed where the winding number is 1/2"
                  : "the faces surround nothing that was found: a shell would give them a thickness";
    return byWinding(std::move(reason), std::nullopt, std::move(inside));
  }
  // All that follows is about what rounds: normals would then speak of another surface.
  const auto thin = std::ranges::find_if_not(hierarchy.frames(), hasArea);
  if (thin != hierarchy.frames().end())
    return byWinding("a face is thinner than what coordinates round", thin->origin,
                     Inside(hierarchy, mesh, std::move(rims)));
  const Crossings crossings = findCrossings(hierarchy, 1, kTooNear, progress);
  if (!crossings.found.empty())
    return byWinding("the mesh meets itself, so that normals may mislead", crossings.found[0].place,
                     Inside(hierarchy, mesh, std::move(rims)));
  const std::vector<std::uint32_t> pieces = greatestOfPieces(hierarchy, sides);
  if (pieces.size() > 1) {
    Inside inside(hierarchy, mesh, std::move(rims));
    if (const auto place = misplaced(hierarchy, pieces, inside))
      return byWinding("a part looks the wrong way, or lies within another", place, std::move(inside));
  }
  Pseudonormals normals(hierarchy);
  if (const auto place = tooSharp(hierarchy, normals))
    return byWinding("an edge or corner is too sharp for normals", place, Inside(hierarchy, mesh, std::move(rims)));
  return {.choice = {InsideTest::pseudonormal, "the mesh has no holes and does not meet itself"},
          .normals = std::move(normals)};
}

}  // namespace hpsdf::distance
