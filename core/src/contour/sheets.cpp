#include "contour/sheets.h"

#include <algorithm>
#include <cassert>
#include <optional>

#include "mesh/connectivity.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

/// Returns the crossed edges of each leaf, in ascending order. A leaf and one of its edges are an incidence, of which
/// the number is its place in this list.
detail::Grouping edgesOfLeaves(std::size_t cells, std::span<const CrossedEdge> edges) {
  return {cells, [&](const auto& visit) {
            for (std::uint32_t e = 0; e < edges.size(); ++e)
              for (std::size_t i = 0; i < 4; ++i) {
                const std::int32_t cell = edges[e].cells[i];
                // A greater leaf can be at two places in succession, which the last and the first are too.
                if (cell >= 0 && cell != edges[e].cells[(i + 3) % 4]) visit(static_cast<std::size_t>(cell), e);
              }
          }};
}

/// Returns the number of an incidence.
std::uint32_t incidenceOf(const detail::Grouping& edgesOfLeaf, std::int32_t leaf, std::uint32_t edge) {
  const auto cell = static_cast<std::size_t>(leaf);
  const std::span edges = edgesOfLeaf[cell];
  assert(std::ranges::find(edges, edge) != edges.end());
  return edgesOfLeaf.countBefore(cell) + static_cast<std::uint32_t>(std::ranges::find(edges, edge) - edges.begin());
}

/// Calls visit(number, leaf, edge) for each incidence, in ascending order.
template <typename Visit>
void forEachIncidence(const detail::Grouping& edgesOfLeaf, std::size_t cells, const Visit& visit) {
  std::uint32_t incidence = 0;
  for (std::size_t cell = 0; cell < cells; ++cell)
    for (const std::uint32_t edge : edgesOfLeaf[cell]) visit(incidence++, static_cast<std::int32_t>(cell), edge);
}

/// A crossed edge on the boundary of a face.
struct OnFace {
  std::int64_t along;  ///< position on the boundary, counter-clockwise from the face's lowest corner
  std::uint32_t edge;
  bool insideAfter;  ///< the boundary continues inside after this edge
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

/// Returns the leaf on the other side of a face, on whose boundary the edge lies.
std::int32_t leafBeyond(const CrossedEdge& edge, std::int32_t leaf, int axisOfFace) {
  const auto place = static_cast<std::size_t>(std::ranges::find(edge.cells, leaf) - edge.cells.begin());
  // The leaves lie counter-clockwise around the edge: numbers 0 and 1 differ along the next axis, 0 and 3 along the one
  // after it.
  return edge.cells[place ^ (axisOfFace == (edge.axis + 1) % 3 ? 1U : 3U)];
}

/// Appends the links through a face of a leaf. A face belongs to the smaller of the leaves on both sides, and to the
/// first of two equal ones. `boundary` is memory for the crossed edges of a face.
void appendLinks(const ContourOctree& octree, std::span<const CrossedEdge> edges, std::int32_t leaf,
                 std::span<const std::uint32_t> ofLeaf, const CellFace& face, std::vector<OnFace>& boundary,
                 std::vector<Link>& links) {
  const ContourCell& cell = octree[leaf];
  boundary.clear();
  for (const std::uint32_t edge : ofLeaf)
    if (const auto place = placeOnFace(cell, face, edges[edge], edge)) boundary.push_back(*place);
  if (boundary.empty()) return;
  const std::int32_t other = leafBeyond(edges[boundary.front().edge], leaf, face.axis);
  if (other < 0 || octree[other].size < cell.size || (octree[other].size == cell.size && other < leaf)) return;
  std::ranges::sort(boundary, {}, &OnFace::along);
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    if (!boundary[i].insideAfter) continue;
    const std::uint32_t one = boundary[i].edge, next = boundary[(i + 1) % boundary.size()].edge;
    links.push_back({.edges = {std::min(one, next), std::max(one, next)},
                     .cells = {leaf, other},
                     .face = face,
                     .isOnly = boundary.size() == 2});
  }
}

std::vector<Link> findLinks(const ContourOctree& octree, std::span<const CrossedEdge> edges,
                            const detail::Grouping& edgesOfLeaf) {
  constexpr std::size_t kCellsAtOnce = 4096;
  return detail::listOfChunks<Link>(octree.cells().size(), kCellsAtOnce, {}, "",
                                    [&](std::vector<Link>& links, std::size_t first, std::size_t count) {
                                      std::vector<OnFace> boundary;
                                      for (std::size_t cell = first; cell < first + count; ++cell)
                                        for (int face = 0; face < 6 && !edgesOfLeaf[cell].empty(); ++face)
                                          appendLinks(octree, edges, static_cast<std::int32_t>(cell), edgesOfLeaf[cell],
                                                      {face / 2, face % 2 == 1}, boundary, links);
                                    });
}

}  // namespace

Box boxOf(const ContourOctree& octree, const Link& link) {
  const ContourCell& cell = octree[link.cells[0]];
  const auto& [axis, upper] = link.face;
  const Box box = octree.box(cell);
  Vector3 margin = Vector3::Constant(1e-3 * octree.edge(cell));
  margin[axis] = 0;
  Vector3 low = box.min() + margin, high = box.max() - margin;
  (upper ? low : high)[axis] = (upper ? high : low)[axis];
  return Box(low, high);
}

Sheets::Sheets(const ContourOctree& octree, std::span<const CrossedEdge> edges) : around_(edges.size()) {
  const std::size_t cells = octree.cells().size();
  const detail::Grouping edgesOfLeaf = edgesOfLeaves(cells, edges);
  links_ = findLinks(octree, edges, edgesOfLeaf);
  mesh::DisjointSets sets(edgesOfLeaf.count());
  for (const Link& link : links_)
    for (const std::int32_t side : link.cells)
      sets.join(incidenceOf(edgesOfLeaf, side, link.edges[0]), incidenceOf(edgesOfLeaf, side, link.edges[1]));

  // Sheets are numbered in the order of their first incidences.
  std::vector<std::uint32_t> sheetOf(edgesOfLeaf.count());
  forEachIncidence(edgesOfLeaf, cells, [&](std::uint32_t incidence, std::int32_t cell, std::uint32_t edge) {
    const std::uint32_t lowest = sets.first(incidence);
    if (lowest == incidence) {
      sheetOf[incidence] = static_cast<std::uint32_t>(cells_.size());
      cells_.push_back(cell);
    }
    sheetOf[incidence] = sheetOf[lowest];
    for (std::size_t place = 0; place < 4; ++place)
      if (edges[edge].cells[place] == cell) around_[edge][place] = sheetOf[incidence];
  });
  edges_ = detail::Grouping(cells_.size(), [&](const auto& visit) {
    forEachIncidence(edgesOfLeaf, cells, [&](std::uint32_t incidence, std::int32_t, std::uint32_t edge) {
      visit(sheetOf[incidence], edge);
    });
  });
  linksOfEdge_ = detail::Grouping(edges.size(), [&](const auto& visit) {
    for (std::uint32_t n = 0; n < links_.size(); ++n)
      for (const std::uint32_t edge : links_[n].edges) visit(edge, n);
  });
}

std::uint32_t Sheets::linkOf(std::uint32_t edge, std::int32_t one, std::int32_t other) const {
  const std::span links = linksOfEdge_[edge];
  const auto found = std::ranges::find_if(links, [&](std::uint32_t n) {
    const std::array<std::int32_t, 2>& cells = links_[n].cells;
    return (cells[0] == one && cells[1] == other) || (cells[0] == other && cells[1] == one);
  });
  assert(found != links.end());
  return *found;
}

}  // namespace hpsdf::contouring
