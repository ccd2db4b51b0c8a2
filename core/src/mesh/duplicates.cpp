#include "mesh/duplicates.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>

#include "mesh/directed_edges.h"
#include "mesh/face_sets.h"

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
  int along = 1;           ///< so many look as the first does,
  int against = 0;         ///< so many the other way

  bool looksBothWays() const { return against > 0; }
  std::uint32_t kept() const { return against > along ? opposite : first; }
  int excess() const { return std::abs(along - against); }  ///< so many more look as the kept one does
};

struct Groups {
  std::vector<Group> all;
  std::vector<std::uint32_t> of;  ///< each face's
  std::vector<Side> sides;        ///< of those that are kept, by edge; `Side::face` is the group
};

Groups groupsOf(std::span<const Triangle> triangles) {
  std::vector<std::array<std::uint32_t, 4>> order(triangles.size());  // the corners sorted, and the face
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    const auto [a, b, c] = sorted(triangles[f]);
    order[f] = {a, b, c, f};
  }
  std::ranges::sort(order);
  Groups groups{.all = {}, .of = std::vector<std::uint32_t>(triangles.size()), .sides = {}};
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::uint32_t f = order[i][3];
    if (i == 0 || !std::equal(order[i].begin(), order[i].begin() + 3, order[i - 1].begin())) {
      groups.all.push_back({.first = f, .opposite = f});
    } else {
      Group& group = groups.all.back();
      const bool agrees = isEven(triangles[f]) == isEven(triangles[group.first]);
      if (!agrees && !group.looksBothWays()) group.opposite = f;
      ++(agrees ? group.along : group.against);
    }
    groups.of[f] = static_cast<std::uint32_t>(groups.all.size() - 1);
  }
  if (groups.all.size() == triangles.size()) return groups;
  std::vector<Triangle> kept;
  for (const Group& group : groups.all) kept.push_back(triangles[group.kept()]);
  groups.sides = sidesByEdge(kept);
  return groups;
}

/// Calls visit(a set of these groups, the sides there) for each edge that one of some groups has, 1 in `chosen`.
template <typename Visit>
void forEachEdgeOf(const Groups& groups, const std::vector<char>& chosen, FaceSets& sets, const Visit& visit) {
  forEachEdge(groups.sides, [&](std::span<const Side> edge) {
    const auto first = std::ranges::find_if(edge, [&](const Side& side) { return chosen[side.face]; });
    if (first != edge.end()) visit(sets.first(first->face), edge);
  });
}

/// Sets of some groups that hang together by edges, each by its lowest group.
FaceSets setsOf(const Groups& groups, const std::vector<char>& chosen) {
  FaceSets sets(groups.all.size());
  forEachEdgeOf(groups, chosen, sets, [&](std::uint32_t set, std::span<const Side> edge) {
    for (const Side& side : edge)
      if (chosen[side.face]) sets.join(set, side.face);
  });
  return sets;
}

int insideTestOf(const Side& side) { return side.rising ? 1 : -1; }

/// Of each group: whether it is of a wall.
std::vector<char> wallsOf(const Groups& groups) {
  std::vector<char> both(groups.all.size());
  for (std::size_t g = 0; g < both.size(); ++g) both[g] = groups.all[g].looksBothWays();
  FaceSets sets = setsOf(groups, both);
  struct Around {
    bool others = false;                       // faces that look one way only, along the set's edges
    bool unbalanced = false, asGiven = false;  // those, of each group one; and all of them
  };
  std::vector<Around> around(groups.all.size());
  forEachEdgeOf(groups, both, sets, [&](std::uint32_t set, std::span<const Side> edge) {
    int balance = 0, asGiven = 0;
    for (const Side& side : edge) {
      if (both[side.face]) continue;
      around[set].others = true;
      balance += insideTestOf(side);
      asGiven += insideTestOf(side) * groups.all[side.face].excess();
    }
    around[set].unbalanced |= balance != 0;
    around[set].asGiven |= asGiven != 0;
  });
  std::vector<char> walls(groups.all.size());
  for (std::uint32_t g = 0; g < walls.size(); ++g) {
    const Around& here = around[sets.first(g)];
    walls[g] = both[g] && here.others && !(here.unbalanced && here.asGiven);
  }
  return walls;
}

/// How many faces of a group stay.
struct Stay {
  int asKept = 1;  ///< of those that look as the kept one does
  int turned = 0;  ///< of the others

  int excess() const { return asKept - turned; }
};

/// Of several faces of a group drops those without which fewer edges are unbalanced, from the outlines of what is too
/// many inwards.
void dropStrays(const Groups& groups, const std::vector<char>& several, std::vector<Stay>& stay) {
  std::vector<int> balances;                                         // of each edge
  std::vector<std::array<std::size_t, 3>> edges(groups.all.size());  // of each group
  std::vector<std::array<int, 3>> signs(groups.all.size());
  std::vector<std::uint8_t> count(groups.all.size());
  forEachEdge(groups.sides, [&](std::span<const Side> edge) {
    int balance = 0;
    for (const Side& side : edge) {
      balance += insideTestOf(side) * stay[side.face].excess();
      edges[side.face][count[side.face]] = balances.size();
      signs[side.face][count[side.face]++] = insideTestOf(side);
    }
    balances.push_back(balance);
  });
  const auto drops = [&](std::size_t g) {
    int fewer = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const int balance = balances[edges[g][k]];
      fewer += int(balance != 0) - int(balance != signs[g][k]);
    }
    if (fewer <= 0) return false;
    for (std::size_t k = 0; k < 3; ++k) balances[edges[g][k]] -= signs[g][k];
    --stay[g].asKept;
    return true;
  };
  for (bool any = true; any;) {  // each time fewer edges are unbalanced
    any = false;
    for (std::size_t g = 0; g < groups.all.size(); ++g)
      while (several[g] && stay[g].asKept > 1 && drops(g)) any = true;
  }
}

/// One of each group, or one each way; but where bodies share them that look the same way there, all but strays: where
/// with one more edges would be unbalanced.
std::vector<Stay> stayOf(const Groups& groups, const std::vector<char>& walls) {
  std::vector<char> several(groups.all.size());
  std::vector<Stay> least(groups.all.size()), stay(groups.all.size());
  for (std::uint32_t g = 0; g < several.size(); ++g) {
    const Group& group = groups.all[g];
    const auto [fewer, more] = std::minmax(group.along, group.against);
    several[g] = walls[g] ? group.along + group.against > 2 : !group.looksBothWays() && group.along > 1;
    least[g] = {1, walls[g]};
    stay[g] = several[g] ? Stay{more, fewer} : least[g];
  }
  dropStrays(groups, several, stay);
  FaceSets sets = setsOf(groups, several);
  std::vector<int> lost(groups.all.size());  // edges
  forEachEdgeOf(groups, several, sets, [&](std::uint32_t set, std::span<const Side> edge) {
    int withLeast = 0, balance = 0;
    for (const Side& side : edge) {
      withLeast += insideTestOf(side) * least[side.face].excess();
      balance += insideTestOf(side) * stay[side.face].excess();
    }
    lost[set] += int(withLeast != 0) - int(balance != 0);
  });
  for (std::uint32_t g = 0; g < stay.size(); ++g)
    if (lost[sets.first(g)] <= 0) stay[g] = least[g];
  return stay;
}

}  // namespace

bool areTwins(const Triangle& one, const Triangle& other) { return sorted(one) == sorted(other); }

std::vector<char> superfluousFaces(std::span<const Triangle> triangles) {
  const Groups groups = groupsOf(triangles);
  if (groups.all.size() == triangles.size()) return std::vector<char>(triangles.size());
  const std::vector<Stay> stay = stayOf(groups, wallsOf(groups));
  std::vector<Stay> seen(groups.all.size(), Stay{0, 0});
  std::vector<char> superfluous(triangles.size());
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    const std::uint32_t g = groups.of[f];
    const bool asKept = isEven(triangles[f]) == isEven(triangles[groups.all[g].kept()]);
    superfluous[f] = asKept ? seen[g].asKept++ >= stay[g].asKept : seen[g].turned++ >= stay[g].turned;
  }
  return superfluous;
}

}  // namespace hpsdf
