#include "mesh/duplicates.h"

#include <algorithm>
#include <cstddef>

#include "mesh/face_sets.h"
#include "mesh/sides.h"

namespace hpsdf {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

Triangle sorted(Triangle corners) {
  std::ranges::sort(corners);
  return corners;
}

/// Whether the corners are an even number of swaps from being sorted.
bool isEven(const Triangle& t) { return (t[0] < t[1]) == ((t[1] < t[2]) == (t[0] < t[2])); }

/// Faces over the same corners.
struct Group {
  std::uint32_t first;     ///< of all
  std::uint32_t opposite;  ///< the first that looks the other way than that, or `first`
  int balance;             ///< so many more look as the first does than the other way

  std::uint32_t kept() const { return balance < 0 ? opposite : first; }
  bool looksBothWays() const { return opposite != first; }
};

std::vector<Group> groupsOf(std::span<const Triangle> triangles) {
  std::vector<std::array<std::uint32_t, 4>> order(triangles.size());  // the corners sorted, and the face
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    const auto [a, b, c] = sorted(triangles[f]);
    order[f] = {a, b, c, f};
  }
  std::ranges::sort(order);
  std::vector<Group> groups;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::uint32_t f = order[i][3];
    if (i == 0 || !std::equal(order[i].begin(), order[i].begin() + 3, order[i - 1].begin())) {
      groups.push_back({f, f, 1});
      continue;
    }
    Group& group = groups.back();
    const bool agrees = isEven(triangles[f]) == isEven(triangles[group.first]);
    group.balance += agrees ? 1 : -1;
    if (!agrees && group.opposite == group.first) group.opposite = f;
  }
  return groups;
}

/// Of each group: whether it is of a wall.
std::vector<char> wallsOf(std::span<const Triangle> triangles, const std::vector<Group>& groups) {
  std::vector<Triangle> faces;
  for (const Group& group : groups) faces.push_back(triangles[group.kept()]);
  const std::vector<Side> sides = sidesByEdge(faces);
  FaceSets sets(groups.size());
  struct Around {
    bool others = false, unbalanced = false;  // faces that look one way only, along the set's edges
  };
  std::vector<Around> around(groups.size());
  const auto visitEdges = [&](const auto& visit) {
    forEachEdge(sides, [&](std::span<const Side> edge) {
      const auto both = std::ranges::find_if(edge, [&](const Side& s) { return groups[s.face].looksBothWays(); });
      if (both != edge.end()) visit(edge, both->face);
    });
  };
  visitEdges([&](std::span<const Side> edge, std::uint32_t group) {
    for (const Side& side : edge)
      if (groups[side.face].looksBothWays()) sets.join(group, side.face);
  });
  visitEdges([&](std::span<const Side> edge, std::uint32_t group) {
    int others = 0, balance = 0;
    for (const Side& side : edge) {
      if (groups[side.face].looksBothWays()) continue;
      ++others;
      balance += side.rising ? 1 : -1;
    }
    Around& here = around[sets.first(group)];
    here.others |= others > 0;
    here.unbalanced |= balance != 0;
  });
  std::vector<char> walls(groups.size());
  for (std::uint32_t g = 0; g < groups.size(); ++g) {
    const Around& here = around[sets.first(g)];
    walls[g] = groups[g].looksBothWays() && here.others && !here.unbalanced;
  }
  return walls;
}

}  // namespace

bool areTwins(const Triangle& one, const Triangle& other) { return sorted(one) == sorted(other); }

std::vector<char> superfluousFaces(std::span<const Triangle> triangles) {
  const std::vector<Group> groups = groupsOf(triangles);
  const bool someLookBothWays = std::ranges::any_of(groups, &Group::looksBothWays);
  const std::vector<char> walls = someLookBothWays ? wallsOf(triangles, groups) : std::vector<char>(groups.size());
  std::vector<char> superfluous(triangles.size(), 1);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    superfluous[groups[g].kept()] = 0;
    if (walls[g]) superfluous[groups[g].opposite] = 0;
  }
  return superfluous;
}

}  // namespace hpsdf
