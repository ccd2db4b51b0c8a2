#include "contour/sheets.h"

#include <algorithm>
#include <cassert>
#include <compare>
#include <optional>

#include "mesh/connectivity.h"
#include "util/chunks.h"

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

/// Returns the leaf on the other side of a face, on whose boundary the edge lies.
std::int32_t leafBeyond(const CrossedEdge& edge, std::int32_t leaf, int axisOfFace) {
  const auto place = static_cast<std::size_t>(std::ranges::find(edge.cells, leaf) - edge.cells.begin());
  // The leaves lie counter-clockwise around the edge: numbers 0 and 1 differ along the next axis, 0 and 3 along the one
  // after it.
  return edge.cells[place ^ (axisOfFace == (edge.axis + 1) % 3 ? 1U : 3U)];
}

/// Appends the links through a face of a leaf. A face belongs to the smaller of the leaves on both sides, and to the
/// first of two equal ones. `boundary` is memory for the crossed edges of a face.
void appendLinks(const ContourOctree& octree, std::span<const CrossedEdge> edges, std::span<const Incidence> ofLeaf,
                 const CellFace& face, std::vector<OnFace>& boundary, std::vector<Link>& links) {
  const std::int32_t leaf = ofLeaf.front().cell;
  const ContourCell& cell = octree[leaf];
  boundary.clear();
  for (const Incidence& at : ofLeaf)
    if (const auto place = placeOnFace(cell, face, edges[at.edge], at.edge)) boundary.push_back(*place);
  if (boundary.empty()) return;
  const std::int32_t other = leafBeyond(edges[boundary.front().edge], leaf, face.axis);
  if (other < 0 || octree[other].size < cell.size || (octree[other].size == cell.size && other < leaf)) return;
  std::ranges::sort(boundary, {}, &OnFace::along);
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    if (!boundary[i].insideAfter) continue;
    const std::uint32_t one = boundary[i].edge, next = boundary[(i + 1) % boundary.size()].edge;
    links.push_back({.edges = {std::min(one, next), std::max(one, next)},
                     .cells = {leaf, other},
                     .axis = face.axis,
                     .face = insideOf(octree, cell, face),
                     .isOnly = boundary.size() == 2});
  }
}

std::vector<Link> findLinks(const ContourOctree& octree, std::span<const CrossedEdge> edges,
                            const Incidences& incidences) {
  constexpr std::size_t kCellsAtOnce = 4096;
  return detail::listOfChunks<Link>(
      octree.cells().size(), kCellsAtOnce, {}, "", [&](std::vector<Link>& links, std::size_t first, std::size_t count) {
        std::vector<OnFace> boundary;
        for (std::size_t cell = first; cell < first + count; ++cell) {
          const auto ofLeaf = incidences.ofCell(static_cast<std::int32_t>(cell));
          for (int face = 0; face < 6 && !ofLeaf.empty(); ++face)
            appendLinks(octree, edges, ofLeaf, {face / 2, face % 2 == 1}, boundary, links);
        }
      });
}

}  // namespace

Sheets::Sheets(const ContourOctree& octree, std::span<const CrossedEdge> edges) : around_(edges.size()) {
  const Incidences incidences(octree.cells().size(), edges);
  links_ = findLinks(octree, edges, incidences);
  mesh::DisjointSets sets(incidences.size());
  for (const Link& link : links_)
    for (const std::int32_t side : link.cells)
      sets.join(incidences.find(side, link.edges[0]), incidences.find(side, link.edges[1]));

  // Number the sheets in the order of their first incidences, and count their edges.
  std::vector<std::uint32_t> sheetOf(incidences.size());
  for (std::uint32_t i = 0; i < incidences.size(); ++i) {
    const auto [cell, edge] = incidences[i];
    const std::uint32_t lowest = sets.first(i);
    if (lowest == i) {
      sheetOf[i] = static_cast<std::uint32_t>(cells_.size());
      cells_.push_back(cell);
      first_.push_back(0);
    }
    sheetOf[i] = sheetOf[lowest];
    ++first_[sheetOf[i] + 1];
    for (std::size_t place = 0; place < 4; ++place)
      if (edges[edge].cells[place] == cell) around_[edge][place] = sheetOf[i];
  }
  for (std::size_t sheet = 0; sheet < cells_.size(); ++sheet) first_[sheet + 1] += first_[sheet];
  edges_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t i = 0; i < incidences.size(); ++i) edges_[next[sheetOf[i]]++] = incidences[i].edge;
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
