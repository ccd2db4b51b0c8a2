#include "distance/inside_test.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mesh/directed_edges.h"
#include "mesh/disjoint_sets.h"
#include "surface/crossings.h"

namespace hpsdf::distance {
namespace {

using bvh::Hierarchy;
using sign::BoundaryEdges;
using sign::Pseudonormals;
using sign::WindingSign;

constexpr int kLattice = 16;  // points along each axis
/// Distance, for coordinates of order 1, of two triangles to which the distances from a point may round to the same.
constexpr double kTooNear = 0x1p-44;
/// Least length of a pseudonormal. At an edge it is the angle between the two faces. The dot product that decides the
/// sign beside such an edge is half the square of the angle, which has to be far above rounding errors.
constexpr double kSharp = 1e-6;

/// Returns true if any point of a lattice is inside an open mesh. The lattice extends beyond the box, which may be
/// flat.
bool enclosesAnyPoint(const WindingSign& winding, const Box& mesh) {
  const Vector3 beyond = Vector3::Constant(0.1 * mesh.sizes().norm());
  const Box box(mesh.min() - beyond, mesh.max() + beyond);
  const Vector3 size = box.sizes();
  std::atomic<bool> any = false;
  tbb::parallel_for(0, kLattice * kLattice * kLattice, [&](int i) {
    const Vector3 index(i % kLattice, i / kLattice % kLattice, i / (kLattice * kLattice));
    if (!any && winding.isInside(box.min() + size.cwiseProduct((index + Vector3::Constant(0.5)) / kLattice)))
      any = true;
  });
  return any;
}

/// Returns the slot of the largest triangle of each component that is connected by edges of two consistent triangles.
std::vector<std::uint32_t> largestOfComponents(const Hierarchy& hierarchy,
                                               const std::vector<mesh::DirectedEdge>& sides) {
  const auto frames = hierarchy.frames();
  mesh::DisjointSets components(frames.size());
  mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> edge) {
    if (edge.size() == 2 && edge[0].rising != edge[1].rising) components.join(edge[0].face, edge[1].face);
  });
  const auto area = [&](std::uint32_t slot) { return frames[slot].length * frames[slot].apexAcross; };
  std::vector<std::uint32_t> largest(frames.size());  // by the lowest slot of the component, which comes first
  for (std::uint32_t slot = 0; slot < frames.size(); ++slot) {
    const std::uint32_t first = components.first(slot);
    if (first == slot || area(slot) > area(largest[first])) largest[first] = slot;
  }
  std::vector<std::uint32_t> slots;
  for (std::uint32_t slot = 0; slot < frames.size(); ++slot)
    if (components.first(slot) == slot) slots.push_back(largest[slot]);
  return slots;
}

/// Returns the lowest of `count` indices for which test(index) holds, if there is one. Tests them in parallel.
template <typename Test>
std::optional<std::size_t> firstWhere(std::size_t count, const Test& test) {
  std::vector<char> holds(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { holds[i] = test(i); });
  const auto first = std::ranges::find(holds, 1);
  if (first == holds.end()) return std::nullopt;
  return static_cast<std::size_t>(first - holds.begin());
}

/// Returns true if the pseudonormal of a vertex or edge of a triangle is dominated by rounding errors.
bool isSharp(const Hierarchy& hierarchy, const Pseudonormals& normals, std::uint32_t slot) {
  bool sharp = false;
  for (std::uint32_t k = 0; k < 3; ++k)
    sharp |= normals.ofVertex(hierarchy.triangles()[slot][k]).norm() < kSharp ||
             normals.ofEdge(hierarchy, slot, k).norm() < kSharp;
  return sharp;
}

}  // namespace

ChosenInsideTest chooseInsideTest(const Hierarchy& hierarchy, const TriangleMesh& mesh, const Progress& progress) {
  const auto byWinding = [](std::string reason, std::optional<Vector3> position, WindingSign winding) {
    return ChosenInsideTest{.choice = {InsideTest::winding, std::move(reason), position},
                            .winding = std::move(winding)};
  };
  const auto frames = hierarchy.frames();

  // Holes need the winding number.
  const std::vector<mesh::DirectedEdge> sides = mesh::directedEdgesOf(hierarchy.triangles());
  BoundaryEdges edges(hierarchy, sides);
  if (const std::size_t unbalanced = edges.size(); unbalanced > 0) {
    WindingSign winding(hierarchy, mesh, std::move(edges));
    std::string reason = std::to_string(unbalanced);
    reason += unbalanced == 1 ? " edge is" : " edges are";
    reason += " unbalanced (holes or reversed faces), and ";
    reason += enclosesAnyPoint(winding, boundingBox(mesh))
                  ? "holes are closed where the winding number is 1/2"
                  : "the faces enclose nothing: a shell would give them a thickness";
    return byWinding(std::move(reason), std::nullopt, std::move(winding));
  }

  // Rounding errors, and surfaces nearer than these, would make pseudonormals those of another surface.
  const auto thin = std::ranges::find_if_not(frames, bvh::hasArea);
  if (thin != frames.end())
    return byWinding("a face is thinner than the rounding errors of its corners", thin->origin,
                     WindingSign(hierarchy, mesh, std::move(edges)));
  const Crossings crossings = surface::findCrossings(hierarchy, 1, kTooNear, progress);
  if (!crossings.found.empty())
    return byWinding("the mesh intersects itself, so that normals may mislead", crossings.found[0].position,
                     WindingSign(hierarchy, mesh, std::move(edges)));

  // Components must be nested and oriented like solids and their cavities.
  const std::vector<std::uint32_t> largest = largestOfComponents(hierarchy, sides);
  if (largest.size() > 1) {
    WindingSign winding(hierarchy, mesh, std::move(edges));
    const auto isWrong = [&](std::size_t i) { return !winding.separatesOutsideFromInside(largest[i]); };
    if (const auto wrong = firstWhere(largest.size(), isWrong))
      return byWinding("a component is oriented the wrong way, or lies within another", frames[largest[*wrong]].origin,
                       std::move(winding));
  }
  Pseudonormals normals(hierarchy);
  const auto tooSharp = [&](std::size_t slot) { return isSharp(hierarchy, normals, static_cast<std::uint32_t>(slot)); };
  if (const auto sharp = firstWhere(frames.size(), tooSharp))
    return byWinding("an edge or corner is too sharp for normals", frames[*sharp].origin,
                     WindingSign(hierarchy, mesh, std::move(edges)));
  return {.choice = {InsideTest::pseudonormal, "the mesh has no holes and does not intersect itself"},
          .normals = std::move(normals)};
}

}  // namespace hpsdf::distance
