#include "contour/surface_mesh.h"

#include <algorithm>
#include <utility>

#include "contour/polygon_errors.h"
#include "contour/surface_gaps.h"
#include "contour/vertex_placement.h"
#include "mesh/connectivity.h"
#include "surface/crossings.h"
#include "util/single_precision.h"

namespace hpsdf::contouring {
namespace {

constexpr double kUnknownGap = -1;

}  // namespace

void SurfaceMesh::updateEdges() {
  updateCrossedEdges(surface_, octree_, cellsOfEdges_, samples_, options_.accuracy, progress_, edges_);
  cellsOfEdges_ = octree_.cells().size();
}

void SurfaceMesh::connect() {
  const std::optional<Sheets> before = std::exchange(sheets_, std::nullopt);
  sheets_.emplace(octree_, edges_);
  placeChangedVertices(before);
  forgetGapsAtChanges();
  for (CrossedEdge& edge : edges_) edge.polygon.isUntested |= edge.polygon.isChanged;
  mesh_ = makeDualMesh(surface_, octree_, edges_, *sheets_, vertices_, {}, options_.accuracy);
  measurePolygons(surface_, mesh_, options_.isOpen, options_.tolerance, progress_, edges_);
  for (CrossedEdge& edge : edges_) edge.polygon.isChanged = false;
}

void SurfaceMesh::forgetGapsAtChanges() {
  gaps_.resize(octree_.cells().size(), kUnknownGap);
  for (const CrossedEdge& edge : edges_)
    for (const std::int32_t cell : edge.cells)
      if (cell >= 0 && edge.polygon.isChanged) gaps_[static_cast<std::size_t>(cell)] = kUnknownGap;
}

/// Places the vertices in leaves at changed edges, and takes those of other leaves from before. Marks all polygons at
/// these leaves as changed.
void SurfaceMesh::placeChangedVertices(const std::optional<Sheets>& before) {
  std::vector<bool> isChanged(octree_.cells().size());
  for (const CrossedEdge& edge : edges_)
    for (const std::int32_t cell : edge.cells)
      if (cell >= 0 && edge.polygon.isChanged) isChanged[static_cast<std::size_t>(cell)] = true;
  const std::vector<Vector3> old = std::exchange(vertices_, std::vector<Vector3>(sheets_->size()));
  std::vector<std::uint32_t> chosen;
  std::uint32_t next = 0;  // Sheets are sorted by their leaves, and those of an unchanged leaf keep their order.
  for (std::uint32_t sheet = 0; sheet < sheets_->size(); ++sheet) {
    const std::int32_t cell = sheets_->cellOf(sheet);
    if (isChanged[static_cast<std::size_t>(cell)]) {
      chosen.push_back(sheet);
      continue;
    }
    while (before->cellOf(next) != cell) ++next;
    vertices_[sheet] = old[next++];
  }
  placeVertices(surface_, octree_, edges_, *sheets_, chosen, options_.accuracy, progress_, vertices_);
  round(vertices_);
  for (const std::uint32_t sheet : chosen)
    for (const std::uint32_t edge : sheets_->edgesOf(sheet)) edges_[edge].polygon.isChanged = true;
}

void SurfaceMesh::round(std::vector<Vector3>& vertices) const {
  if (!options_.isSinglePrecision) return;
  for (Vector3& vertex : vertices) vertex = detail::inSinglePrecision(vertex);
}

const std::vector<double>& SurfaceMesh::findGaps() {
  findSurfaceGaps(surface_, octree_, edges_, *sheets_, mesh_, {options_.tolerance, options_.accuracy}, progress_,
                  gaps_);
  return gaps_;
}

void SurfaceMesh::mend() {
  wrong_ = wrongPolygons(untestedTriangles());
  for (CrossedEdge& edge : edges_) edge.polygon.isUntested = false;
  std::vector<bool> fans(edges_.size());
  while (!wrong_.empty()) {
    const auto marked = std::ranges::count(fans, true);
    for (const std::uint32_t edge : wrong_) fans[edge] = true;
    if (std::ranges::count(fans, true) == marked) break;
    makeFans(fans);
    wrong_ = wrongPolygons(trianglesOfFans());
  }
  fans_ = static_cast<std::size_t>(std::ranges::count(fans, true));
  measurePolygons(surface_, mesh_, options_.isOpen, options_.tolerance, progress_, edges_);
  forgetGapsAtChanges();
}

/// Makes the mesh with fans around the marked edges. Where sheets share a leaf, those of fans have their vertices in
/// the middle. Polygons that become fans, or have such vertices, are changed.
void SurfaceMesh::makeFans(const std::vector<bool>& fans) {
  std::vector<Vector3> vertices = vertices_;
  for (std::uint32_t sheet = 0; sheet < sheets_->size(); ++sheet) {
    const bool alone = (sheet == 0 || sheets_->cellOf(sheet - 1) != sheets_->cellOf(sheet)) &&
                       (sheet + 1 == sheets_->size() || sheets_->cellOf(sheet + 1) != sheets_->cellOf(sheet));
    if (alone || std::ranges::none_of(sheets_->edgesOf(sheet), [&](std::uint32_t edge) { return fans[edge]; }))
      continue;
    vertices[sheet] = middleOf(*sheets_, sheet, edges_);
    for (const std::uint32_t edge : sheets_->edgesOf(sheet)) edges_[edge].polygon.isChanged = true;
  }
  mesh_ = makeDualMesh(surface_, octree_, edges_, *sheets_, std::move(vertices), fans, options_.accuracy);
  round(mesh_.vertices);
  const std::vector<bool> ofFans = trianglesOfFans();
  for (std::size_t i = 0; i < ofFans.size(); ++i)
    if (ofFans[i]) edges_[mesh_.edgeOfTriangle[i]].polygon.isChanged = true;
}

/// Returns the crossed edges whose polygons cross others, or share an edge with more than one other. Two triangles are
/// tested for crossing if one of them is `chosen`.
std::vector<std::uint32_t> SurfaceMesh::wrongPolygons(const std::vector<bool>& chosen) {
  std::vector<std::uint32_t> wrong;
  const std::vector<mesh::DirectedEdge> sides = mesh::directedEdgesOf(mesh_.triangles);
  mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> side) {
    if (side.size() == 2) return;
    for (const mesh::DirectedEdge& one : side) wrong.push_back(mesh_.edgeOfTriangle[one.face]);
  });
  if (!mesh_.triangles.empty()) {
    const Crossings crossings = surface::findCrossingsOf({mesh_.vertices, mesh_.triangles, "contour"}, chosen,
                                                         kMaxCrossings, Progress{.cancelled = progress_.cancelled});
    knowsAllCrossings_ = crossings.complete;
    for (const Crossing& crossing : crossings.found)
      for (const std::uint32_t triangle : crossing.triangles) wrong.push_back(mesh_.edgeOfTriangle[triangle]);
  }
  std::ranges::sort(wrong);
  wrong.erase(std::unique(wrong.begin(), wrong.end()), wrong.end());
  return wrong;
}

/// Returns, for each triangle, whether its polygon was made after the last search for crossings.
std::vector<bool> SurfaceMesh::untestedTriangles() const {
  std::vector<bool> untested(mesh_.triangles.size());
  for (std::size_t i = 0; i < untested.size(); ++i)
    untested[i] = !knowsAllCrossings_ || edges_[mesh_.edgeOfTriangle[i]].polygon.isUntested;
  return untested;
}

/// Returns, for each triangle, whether it has a vertex that is not where it was before there were fans. Others do not
/// cross each other, as those that did have become fans, unless not all crossings are known.
std::vector<bool> SurfaceMesh::trianglesOfFans() const {
  std::vector<bool> changed(mesh_.triangles.size());
  for (std::size_t i = 0; i < changed.size(); ++i)
    changed[i] = !knowsAllCrossings_ || std::ranges::any_of(mesh_.triangles[i], [&](std::uint32_t vertex) {
      return vertex >= vertices_.size() || mesh_.vertices[vertex] != vertices_[vertex];
    });
  return changed;
}

}  // namespace hpsdf::contouring
