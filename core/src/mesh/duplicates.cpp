#include "mesh/duplicates.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>

#include "mesh/connectivity.h"

namespace hpsdf::mesh {
namespace {

Triangle sorted(Triangle t) {
  std::ranges::sort(t);
  return t;
}

/// Returns true if the corners are an even permutation of their ascending order. Triangles with the same corners
/// have the same orientation if both are even or both are odd.
bool isEven(const Triangle& t) { return (t[0] < t[1]) == ((t[1] < t[2]) == (t[0] < t[2])); }

/// A group of duplicates: all triangles with the same three corners.
struct Group {
  std::uint32_t first;          ///< lowest index of a triangle in the group
  std::uint32_t firstReversed;  ///< lowest index of a triangle oriented opposite to `first`; `first` if there is none
  int same = 1;                 ///< number of triangles with the orientation of `first`
  int reversed = 0;             ///< number of triangles with the opposite orientation

  bool hasBothOrientations() const { return reversed > 0; }
  /// Returns the first triangle of the group that has the more frequent orientation.
  std::uint32_t representative() const { return reversed > same ? firstReversed : first; }
  /// Returns how many more triangles have the more frequent orientation than the opposite one.
  int excess() const { return std::abs(same - reversed); }
};

struct Groups {
  std::vector<Group> all;
  std::vector<std::uint32_t> groupOf;  ///< index of each triangle's group in `all`
  std::vector<DirectedEdge> edges;     ///< edges of one triangle per group; `DirectedEdge::face` is the group's index
};

/// Groups the triangles that have the same corners. `Groups::edges` stays empty if no two triangles have the same
/// corners.
Groups groupsOf(std::span<const Triangle> triangles) {
  std::vector<std::array<std::uint32_t, 4>> order(triangles.size());  // the sorted corners and the triangle's index
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    const auto [a, b, c] = sorted(triangles[f]);
    order[f] = {a, b, c, f};
  }
  tbb::parallel_sort(order.begin(), order.end());
  Groups groups{.all = {}, .groupOf = std::vector<std::uint32_t>(triangles.size()), .edges = {}};
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::uint32_t f = order[i][3];
    if (i == 0 || !std::equal(order[i].begin(), order[i].begin() + 3, order[i - 1].begin())) {
      groups.all.push_back({.first = f, .firstReversed = f});
    } else {
      Group& group = groups.all.back();
      const bool agrees = isEven(triangles[f]) == isEven(triangles[group.first]);
      if (!agrees && !group.hasBothOrientations()) group.firstReversed = f;
      ++(agrees ? group.same : group.reversed);
    }
    groups.groupOf[f] = static_cast<std::uint32_t>(groups.all.size() - 1);
  }
  if (groups.all.size() == triangles.size()) return groups;
  std::vector<Triangle> representatives;
  for (const Group& group : groups.all) representatives.push_back(triangles[group.representative()]);
  groups.edges = directedEdgesOf(representatives);
  return groups;
}

/// Calls visit(set, directed edges) for each undirected edge of the chosen groups of duplicates: the groups g with
/// chosen[g] = 1. The first argument is the index of the set that contains the first chosen group at the edge. The
/// second argument lists all directed edges along the undirected edge.
template <typename Visit>
void forEachEdgeOf(const Groups& groups, const std::vector<char>& chosen, DisjointSets& sets, const Visit& visit) {
  forEachEdge(groups.edges, [&](std::span<const DirectedEdge> edge) {
    const auto first = std::ranges::find_if(edge, [&](const DirectedEdge& e) { return chosen[e.face]; });
    if (first != edge.end()) visit(sets.first(first->face), edge);
  });
}

/// Returns the disjoint sets of groups of duplicates that are connected by edges. Only groups g with chosen[g] = 1 are
/// connected.
DisjointSets connectedSets(const Groups& groups, const std::vector<char>& chosen) {
  DisjointSets sets(groups.all.size());
  forEachEdgeOf(groups, chosen, sets, [&](std::uint32_t set, std::span<const DirectedEdge> edge) {
    for (const DirectedEdge& e : edge)
      if (chosen[e.face]) sets.join(set, e.face);
  });
  return sets;
}

/// Returns +1 or −1 for the direction of a directed edge. The balance of an undirected edge is the sum of these
/// numbers; it is 0 if equally many triangles run along the edge in both directions.
int direction(const DirectedEdge& edge) { return edge.rising ? 1 : -1; }

/// Returns 1 for each group in a wall that two bodies share, else 0. A shared wall is a connected set of groups that
/// have both orientations. Other triangles must adjoin the set, and equally many of them must run along each edge of
/// the set in both directions. It suffices if this holds with duplicates among the other triangles counted only once,
/// or with all of them counted.
std::vector<char> wallsOf(const Groups& groups) {
  std::vector<char> both(groups.all.size());
  for (std::size_t g = 0; g < both.size(); ++g) both[g] = groups.all[g].hasBothOrientations();
  DisjointSets sets = connectedSets(groups, both);
  struct Surroundings {
    bool exist = false;                   // A group with one orientation shares an edge with the set.
    bool unbalanced = false;              // An edge is unbalanced if each adjoining group counts once.
    bool unbalancedByDuplicates = false;  // An edge is unbalanced if all adjoining triangles count.
  };
  std::vector<Surroundings> surroundings(groups.all.size());
  forEachEdgeOf(groups, both, sets, [&](std::uint32_t set, std::span<const DirectedEdge> edge) {
    int balance = 0, withDuplicates = 0;
    for (const DirectedEdge& e : edge) {
      if (both[e.face]) continue;
      surroundings[set].exist = true;
      balance += direction(e);
      withDuplicates += direction(e) * groups.all[e.face].excess();
    }
    surroundings[set].unbalanced |= balance != 0;
    surroundings[set].unbalancedByDuplicates |= withDuplicates != 0;
  });
  std::vector<char> walls(groups.all.size());
  for (std::uint32_t g = 0; g < walls.size(); ++g) {
    const Surroundings& here = surroundings[sets.first(g)];
    walls[g] = both[g] && here.exist && !(here.unbalanced && here.unbalancedByDuplicates);
  }
  return walls;
}

/// The numbers of triangles that are kept from a group of duplicates.
struct Kept {
  int same = 1;      ///< number of triangles with the group's more frequent orientation
  int reversed = 0;  ///< number of triangles with the opposite orientation

  int excess() const { return same - reversed; }
};

/// Drops duplicates from the groups g with several[g] = 1, as long as this reduces the number of unbalanced edges,
/// along which more triangles run in one direction than in the other. Thus a connected set of these groups shrinks
/// from its boundary inwards.
void dropUnbalancingDuplicates(const Groups& groups, const std::vector<char>& several, std::vector<Kept>& kept) {
  // Compute the balance of each undirected edge: the number of triangles that run along it in one direction minus
  // the number that run in the other.
  std::vector<int> balances;
  std::vector<std::array<std::size_t, 3>> edgesOfGroup(groups.all.size());
  std::vector<std::array<int, 3>> directions(groups.all.size());
  std::vector<std::uint8_t> count(groups.all.size());
  forEachEdge(groups.edges, [&](std::span<const DirectedEdge> edge) {
    int balance = 0;
    for (const DirectedEdge& e : edge) {
      balance += direction(e) * kept[e.face].excess();
      edgesOfGroup[e.face][count[e.face]] = balances.size();
      directions[e.face][count[e.face]++] = direction(e);
    }
    balances.push_back(balance);
  });

  const auto dropOne = [&](std::size_t g) {
    int fewer = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const int balance = balances[edgesOfGroup[g][k]];
      fewer += int(balance != 0) - int(balance != directions[g][k]);
    }
    if (fewer <= 0) return false;
    for (std::size_t k = 0; k < 3; ++k) balances[edgesOfGroup[g][k]] -= directions[g][k];
    --kept[g].same;
    return true;
  };
  // Repeat until no duplicate can be dropped. The loop ends because each round but the last reduces the number of
  // unbalanced edges.
  for (bool any = true; any;) {
    any = false;
    for (std::size_t g = 0; g < groups.all.size(); ++g)
      while (several[g] && kept[g].same > 1 && dropOne(g)) any = true;
  }
}

/// Returns how many triangles of each group are kept: at least one, or one of each orientation in a shared wall. If
/// this minimum would leave more edges unbalanced in a connected set of groups, for instance because several bodies
/// share the triangles, only duplicates that unbalance edges are dropped from the set.
std::vector<Kept> keptOf(const Groups& groups, const std::vector<char>& walls) {
  // Mark in `several` the groups with more triangles than the minimum, and drop from these groups the duplicates
  // that unbalance edges.
  std::vector<char> several(groups.all.size());
  std::vector<Kept> least(groups.all.size()), kept(groups.all.size());
  for (std::uint32_t g = 0; g < several.size(); ++g) {
    const Group& group = groups.all[g];
    const auto [fewer, more] = std::minmax(group.same, group.reversed);
    several[g] = walls[g] ? group.same + group.reversed > 2 : !group.hasBothOrientations() && group.same > 1;
    least[g] = {1, walls[g]};
    kept[g] = several[g] ? Kept{more, fewer} : least[g];
  }
  dropUnbalancingDuplicates(groups, several, kept);

  // Reduce each connected set of groups to its minimum, unless that unbalances more edges than it balances.
  DisjointSets sets = connectedSets(groups, several);
  std::vector<int> unbalancedByLeast(groups.all.size());
  forEachEdgeOf(groups, several, sets, [&](std::uint32_t set, std::span<const DirectedEdge> edge) {
    int withLeast = 0, balance = 0;
    for (const DirectedEdge& e : edge) {
      withLeast += direction(e) * least[e.face].excess();
      balance += direction(e) * kept[e.face].excess();
    }
    unbalancedByLeast[set] += int(withLeast != 0) - int(balance != 0);
  });
  for (std::uint32_t g = 0; g < kept.size(); ++g)
    if (unbalancedByLeast[sets.first(g)] <= 0) kept[g] = least[g];
  return kept;
}

}  // namespace

bool haveSameCorners(const Triangle& one, const Triangle& other) { return sorted(one) == sorted(other); }

std::vector<char> redundantFaces(std::span<const Triangle> triangles) {
  const Groups groups = groupsOf(triangles);
  if (groups.all.size() == triangles.size()) return std::vector<char>(triangles.size());
  const std::vector<Kept> kept = keptOf(groups, wallsOf(groups));
  std::vector<Kept> seen(groups.all.size(), Kept{0, 0});
  std::vector<char> redundant(triangles.size());
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    const std::uint32_t g = groups.groupOf[f];
    const bool agrees = isEven(triangles[f]) == isEven(triangles[groups.all[g].representative()]);
    redundant[f] = agrees ? seen[g].same++ >= kept[g].same : seen[g].reversed++ >= kept[g].reversed;
  }
  return redundant;
}

}  // namespace hpsdf::mesh
