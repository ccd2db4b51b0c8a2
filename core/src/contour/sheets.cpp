#include "contour/sheets.h"

#include <algorithm>
#include <cassert>
#include <compare>
#include <optional>

#include "mesh/connectivity.h"

namespace hpsdf::contouring {
namespace {

/// A leaf with one of its crossed edges. Sorted lists have the edges of a leaf side by side.
struct Incidence {
  std::int32_t cell;
  std::uint32_t edge;
};

/// All incidences of crossed edges, sorted by leaf and edge.
class Incidences {
 public:
  Incidences(std::size_t cells, std::span<const CrossedEdge> edges) : first_(cells + 1) {
    forEach(edges, [&](std::int32_t cell, std::uint32_t) { ++first_[static_cast<std::size_t>(cell) + 1]; });
    for (std::size_t cell = 0; cell < cells; ++cell) first_[cell + 1] += first_[cell];
    all_.resize(first_.back());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    forEach(edges, [&](std::int32_t cell, std::uint32_t edge) {
      all_[next[static_cast<std::size_t>(cell)]++] = {cell, edge};
    });
  }

  std::uint32_t size() const { return static_cast<std::uint32_t>(all_.size()); }
  const Incidence& operator[](std::uint32_t i) const { return all_[i]; }

  std::span<const Incidence> ofCell(std::int32_t cell) const {
    const std::uint32_t first = first_[static_cast<std::size_t>(cell)];
    return std::span(all_).subspan(first, first_[static_cast<std::size_t>(cell) + 1] - first);
  }

  std::uint32_t find(std::int32_t cell, std::uint32_t edge) const {
    std::uint32_t i = first_[static_cast<std::size_t>(cell)];
    while (all_[i].edge != edge) ++i;
    assert(all_[i].cell == cell);
    return i;
  }

 private:
  template <typename Visit>
  static void forEach(std::span<const CrossedEdge> edges, const Visit& visit) {
    for (std::uint32_t e = 0; e < edges.size(); ++e)
      for (std::size_t i = 0; i < 4; ++i) {
        const std::int32_t cell = edges[e].cells[i];
        // A greater leaf can be at two places in succession, which the last and the first are too.
        if (cell >= 0 && cell != edges[e].cells[(i + 3) % 4]) visit(cell, e);
      }
  }

  std::vector<std::uint32_t> first_;  ///< by cell: its first place in all_
  std::vector<Incidence> all_;
};

/// A crossed edge on the boundary of a face.
struct OnFace {
  std::int64_t along;  ///< position on the boundary, counter-clockwise from the face's lowest corner
  std::uint32_t edge;
  bool insideAfter;  ///< the boundary continues inside after this edge
};

/// A face of a leaf: the axis normal to it, and whether it is the upper one of the two.
struct CellFace {
  int axis;
  bool upper;
};

/// Returns the place of an edge on the boundary of a face of `cell`, or std::nullopt if the edge is not on it.
std::optional<OnFace> placeOnFace(const ContourCell& cell, const CellFace& face, const CrossedEdge& edge,
                                  std::uint32_t number) {
  if (edge.axis == face.axis || edge.lower[face.axis] != cell.lower[face.axis] + (face.upper ? cell.size : 0))
    return std::nullopt;
  const int u = (face.axis + 1) % 3, v = (face.axis + 2) % 3;
  const std::int64_t size = cell.size, atU = edge.lower[u] - cell.lower[u], atV = edge.lower[v] - cell.lower[v];
  const bool upperInside = !edge.lowerInside;
  if (edge.axis == u && atV == 0) return OnFace{atU, number, upperInside};
  if (edge.axis == v && atU == size) return OnFace{size + atV, number, upperInside};
  if (edge.axis == u && atV == size) return OnFace{3 * size - atU, number, edge.lowerInside};
  if (edge.axis == v && atU == 0) return OnFace{4 * size - atV, number, edge.lowerInside};
  return std::nullopt;
}

/// Returns the box of a face of a cell, without a thousandth of its edge at its boundary.
Box insideOf(const ContourOctree& octree, const ContourCell& cell, const CellFace& face) {
  const Box box = octree.box(cell);
  Vector3 margin = Vector3::Constant(1e-3 * octree.edge(cell));
  margin[face.axis] = 0;
  Vector3 lower = box.min() + margin, upper = box.max() - margin;
  (face.upper ? lower : upper)[face.axis] = (face.upper ? upper : lower)[face.axis];
  return Box(lower, upper);
}

/// Finds the links through faces between leaves, and unites the incidences that they connect.
class Linker {
 public:
  Linker(const ContourOctree& octree, std::span<const CrossedEdge> edges, const Incidences& incidences)
      : octree_(octree), edges_(edges), incidences_(incidences), sets_(incidences.size()) {
    for (std::uint32_t i = 0; i < incidences.size(); ++i) {
      const std::int32_t leaf = incidences[i].cell;
      if (i > 0 && incidences[i - 1].cell == leaf) continue;
      for (int axis = 0; axis < 3; ++axis)
        for (const bool upper : {false, true}) linkThrough(leaf, {axis, upper});
    }
  }

  std::vector<Link>& links() { return links_; }
  mesh::DisjointSets& sets() { return sets_; }

 private:
  /// Links the crossed edges of a face. A face belongs to the smaller of the leaves on both sides, and to the first of
  /// two equal ones.
  void linkThrough(std::int32_t leaf, const CellFace& face) {
    const ContourCell& cell = octree_[leaf];
    GridPoint beyond = cell.lower;
    beyond[face.axis] += face.upper ? cell.size : -1;
    const std::int32_t other = octree_.leafAt(beyond);
    if (other < 0 || octree_[other].size < cell.size || (octree_[other].size == cell.size && other < leaf)) return;
    boundary_.clear();
    for (const Incidence& at : incidences_.ofCell(leaf))
      if (const auto place = placeOnFace(cell, face, edges_[at.edge], at.edge)) boundary_.push_back(*place);
    std::ranges::sort(boundary_, {}, &OnFace::along);
    for (std::size_t i = 0; i < boundary_.size(); ++i) {
      if (!boundary_[i].insideAfter) continue;
      const std::uint32_t one = boundary_[i].edge, next = boundary_[(i + 1) % boundary_.size()].edge;
      links_.push_back({.edges = {std::min(one, next), std::max(one, next)},
                        .cells = {leaf, other},
                        .axis = face.axis,
                        .face = insideOf(octree_, cell, face),
                        .isOnly = boundary_.size() == 2});
      for (const std::int32_t side : {leaf, other})
        sets_.join(incidences_.find(side, one), incidences_.find(side, next));
    }
  }

  const ContourOctree& octree_;
  std::span<const CrossedEdge> edges_;
  const Incidences& incidences_;
  std::vector<Link> links_;
  mesh::DisjointSets sets_;
  std::vector<OnFace> boundary_;
};

}  // namespace

Sheets::Sheets(const ContourOctree& octree, std::span<const CrossedEdge> edges) : around_(edges.size()) {
  const Incidences incidences(octree.cells().size(), edges);
  Linker linker(octree, edges, incidences);
  links_ = std::move(linker.links());

  constexpr std::uint32_t kUnknown = 0xffffffff;
  std::vector<std::uint32_t> sheetOf(incidences.size(), kUnknown);  // by the first incidence of a set
  std::vector<std::vector<std::uint32_t>> edgesOfSheet;
  for (std::uint32_t i = 0; i < incidences.size(); ++i) {
    const auto [cell, edge] = incidences[i];
    std::uint32_t& sheet = sheetOf[linker.sets().first(i)];
    if (sheet == kUnknown) {
      sheet = static_cast<std::uint32_t>(cells_.size());
      cells_.push_back(cell);
      edgesOfSheet.emplace_back();
    }
    edgesOfSheet[sheet].push_back(edge);
    for (std::size_t place = 0; place < 4; ++place)
      if (edges[edge].cells[place] == cell) around_[edge][place] = sheet;
  }
  for (const auto& list : edgesOfSheet) {
    edges_.insert(edges_.end(), list.begin(), list.end());
    first_.push_back(edges_.size());
  }
  listLinks(edges.size());
}

void Sheets::listLinks(std::size_t edges) {
  firstLink_.assign(edges + 1, 0);
  for (const Link& link : links_)
    for (const std::uint32_t edge : link.edges) ++firstLink_[edge + 1];
  for (std::size_t e = 0; e < edges; ++e) firstLink_[e + 1] += firstLink_[e];
  linksOfEdge_.resize(firstLink_.back());
  std::vector<std::size_t> next(firstLink_.begin(), firstLink_.end() - 1);
  for (std::uint32_t n = 0; n < links_.size(); ++n)
    for (const std::uint32_t edge : links_[n].edges) linksOfEdge_[next[edge]++] = n;
}

std::uint32_t Sheets::linkOf(std::uint32_t edge, std::int32_t one, std::int32_t other) const {
  std::size_t i = firstLink_[edge];
  const auto isBetween = [&](const std::array<std::int32_t, 2>& cells) {
    return (cells[0] == one && cells[1] == other) || (cells[0] == other && cells[1] == one);
  };
  while (!isBetween(links_[linksOfEdge_[i]].cells)) ++i;
  assert(i < firstLink_[edge + 1]);
  return linksOfEdge_[i];
}

}  // namespace hpsdf::contouring
