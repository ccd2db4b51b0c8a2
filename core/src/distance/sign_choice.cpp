#include "distance/sign_choice.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <sstream>
#include <utility>

#include "chunks.h"

namespace hpsdf::distance {
namespace {

constexpr int kLattice = 16;                              // places along each axis
constexpr std::uint32_t kBent = 512, kEverywhere = 1024;  // at most, of which both sides are looked at
constexpr double kBeside = 1e-4;                          // of the box's diagonal: so far from a triangle
constexpr std::size_t kTogether = 16;                     // places of one batch

/// The cosine of the greatest angle between a triangle's normal and those of its corners: below 0 where the surface
/// folds over.
double straightness(const Hierarchy& hierarchy, const Pseudonormals& normals, std::uint32_t slot) {
  double least = 1;
  for (const std::uint32_t vertex : hierarchy.triangles()[slot])
    least = std::min(least, hierarchy.frames()[slot].normal.dot(normals.ofVertex(vertex).stableNormalized()));
  return least;
}

/// Some all over the mesh, and those that are bent most.
std::vector<std::uint32_t> trianglesToLookAt(const Hierarchy& hierarchy, const Pseudonormals& normals) {
  const auto count = static_cast<std::uint32_t>(hierarchy.triangles().size());
  std::vector<double> straight(count);
  tbb::parallel_for(std::uint32_t{0}, count,
                    [&](std::uint32_t slot) { straight[slot] = straightness(hierarchy, normals, slot); });
  std::vector<std::uint32_t> slots(count);
  std::iota(slots.begin(), slots.end(), 0u);
  const auto bent = slots.begin() + std::min(count, kBent);
  std::ranges::partial_sort(slots, bent, {}, [&](std::uint32_t slot) { return std::pair(straight[slot], slot); });
  slots.erase(bent, slots.end());
  for (std::uint32_t slot = 0; slot < count; slot += 1 + (count - 1) / kEverywhere) slots.push_back(slot);
  return slots;
}

/// The lattice is off the planes of symmetry, where features of the mesh are likely to be.
std::vector<Vector3> placesToLookAt(const Hierarchy& hierarchy, const Pseudonormals& normals, const Box& box) {
  std::vector<Vector3> places;
  const Vector3 size = box.sizes();
  for (int z = 0; z < kLattice; ++z)
    for (int y = 0; y < kLattice; ++y)
      for (int x = 0; x < kLattice; ++x)
        places.push_back(box.min() + size.cwiseProduct((Vector3(x, y, z) + Vector3(0.47, 0.53, 0.51)) / kLattice));
  for (const std::uint32_t slot : trianglesToLookAt(hierarchy, normals)) {
    const auto& [a, b, c] = hierarchy.triangles()[slot];
    const Vector3 middle = (hierarchy.vertices()[a] + hierarchy.vertices()[b] + hierarchy.vertices()[c]) / 3;
    const Vector3 aside = kBeside * size.norm() * hierarchy.frames()[slot].normal;
    places.push_back(middle + aside);
    places.push_back(middle - aside);
  }
  return places;
}

std::string textOf(const Vector3& x) {
  std::ostringstream text;
  text.precision(4);
  text << "(" << x.x() << ", " << x.y() << ", " << x.z() << ")";
  return text.str();
}

}  // namespace

SignChoice chooseSign(const Hierarchy& hierarchy, const Pseudonormals& normals, const Box& box, const Inside& inside,
                      const SignedByNormals& distances) {
  const std::vector<Vector3> places = placesToLookAt(hierarchy, normals, box);
  std::vector<double> byNormals(places.size()), byWinding(places.size());
  forEachChunk(places.size(), kTogether, [&](std::size_t, std::size_t first, std::size_t count) {
    const std::span at = std::span(places).subspan(first, count);
    const std::span found = std::span(byNormals).subspan(first, count),
                    other = std::span(byWinding).subspan(first, count);
    distances(at, found);
    std::ranges::transform(found, other.begin(), [](double d) { return std::abs(d); });
    inside.sign(at, other);
  });

  SignChoice choice{.openSides = inside.rimSides(), .compared = places.size()};
  bool surrounds = false;
  for (std::size_t i = 0; i < places.size(); ++i) {
    surrounds |= byWinding[i] < 0;
    if ((byNormals[i] < 0) == (byWinding[i] < 0)) continue;
    ++choice.differing;
    if (std::abs(byNormals[i]) <= choice.depth) continue;
    choice.depth = std::abs(byNormals[i]);
    choice.deepest = places[i];
  }
  choice.sign = choice.openSides > 0 || choice.differing > 0 ? Sign::winding : Sign::pseudonormal;
  const std::string sides = std::to_string(choice.openSides) + (choice.openSides == 1 ? " side" : " sides");
  if (choice.openSides > 0 && surrounds)
    choice.reason = sides + " of faces have no neighbour, and holes are closed where the winding number is 1/2";
  else if (choice.openSides > 0)
    choice.reason = sides +
                    " of faces have no neighbour, and they surround nothing that was found: a shell would give "
                    "them a thickness";
  else if (choice.differing > 0)
    choice.reason = "the faces overlap or fold over, so that normals mislead, as at " + textOf(choice.deepest);
  else
    choice.reason = "the mesh is closed, and winding numbers agree wherever they were compared";
  return choice;
}

}  // namespace hpsdf::distance
