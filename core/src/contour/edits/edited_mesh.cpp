#include "contour/edits/edited_mesh.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "mesh/connectivity.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr std::uint32_t kNoNumber = 0xffffffff;

}  // namespace

EditedMesh::EditedMesh(std::vector<Vector3> vertices, std::vector<Triangle> triangles)
    : vertices_(std::move(vertices)), triangles_(std::move(triangles)) {
  listTriangles();
  listPoints();
}

void EditedMesh::setPoints(std::vector<SurfacePoint> points) {
  points_ = std::move(points);
  listPoints();
}

void EditedMesh::listTriangles() {
  trianglesAt_ = detail::Grouping(vertices_.size(), [&](const auto& visit) {
    for (std::uint32_t n = 0; n < triangles_.size(); ++n)
      for (const std::uint32_t vertex : triangles_[n]) visit(vertex, n);
  });
  isAtBoundary_.assign(vertices_.size(), false);
  const std::vector<mesh::DirectedEdge> sides = mesh::directedEdgesOf(triangles_);
  mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> side) {
    if (side.size() == 2) return;
    for (const std::uint32_t end : {side[0].low(), side[0].high()}) isAtBoundary_[end] = true;
  });
}

void EditedMesh::listPoints() {
  pointsOf_ = detail::Grouping(triangles_.size(), [&](const auto& visit) {
    for (std::uint32_t n = 0; n < points_.size(); ++n) visit(points_[n].triangle, n);
  });
}

Corners EditedMesh::cornersAfter(const Edit& edit, const Triangle& triangle) const {
  Corners corners;
  for (std::size_t k = 0; k < 3; ++k) corners[k] = triangle[k] == edit.vertex ? edit.position : vertices_[triangle[k]];
  return corners;
}

/// Gives the points of triangles that an edit removes to the nearest triangle that it adds. Triangles that are added
/// take the places of those that are removed.
void EditedMesh::movePoints(const Edit& edit) {
  std::vector<Corners> added;
  for (const Triangle& triangle : edit.added) added.push_back(cornersAfter(edit, triangle));
  const NearTriangles near(added);
  for (const std::uint32_t n : edit.removed)
    for (const std::uint32_t i : pointsOf_[n])
      points_[i].triangle = edit.removed[near.nearestTo(points_[i].position).first];
}

void EditedMesh::make(std::span<const Edit> edits) {
  constexpr std::size_t kAtOnce = 16;
  if (hasPoints())
    detail::forEachChunk(edits.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
      for (const Edit& edit : edits.subspan(first, count)) movePoints(edit);
    });
  std::vector<bool> isRemoved(triangles_.size());
  for (const Edit& edit : edits)
    for (const std::uint32_t n : edit.removed) isRemoved[n] = true;
  for (const Edit& edit : edits) {
    if (edit.vertex) vertices_[*edit.vertex] = edit.position;
    for (std::size_t i = 0; i < edit.added.size(); ++i) {
      triangles_[edit.removed[i]] = edit.added[i];
      isRemoved[edit.removed[i]] = false;
    }
  }
  std::vector<std::uint32_t> number(triangles_.size());
  std::uint32_t kept = 0;
  for (std::uint32_t n = 0; n < triangles_.size(); ++n) {
    number[n] = kept;
    if (!isRemoved[n]) triangles_[kept++] = triangles_[n];
  }
  triangles_.resize(kept);
  for (SurfacePoint& point : points_) point.triangle = number[point.triangle];
  listTriangles();
  listPoints();
}

TriangleMesh EditedMesh::finish() && {
  std::vector<std::uint32_t> number(vertices_.size(), kNoNumber);
  std::vector<Vector3> used;
  for (std::uint32_t vertex = 0; vertex < vertices_.size(); ++vertex) {
    if (trianglesAt(vertex).empty()) continue;
    number[vertex] = static_cast<std::uint32_t>(used.size());
    used.push_back(vertices_[vertex]);
  }
  for (Triangle& triangle : triangles_)
    for (std::uint32_t& vertex : triangle) vertex = number[vertex];
  return {std::move(used), std::move(triangles_), "contour"};
}

NearTriangles::NearTriangles(std::span<const Corners> triangles) {
  for (const auto& corners : triangles) frames_.push_back(bvh::makeFrame(corners, 0));
}

std::pair<std::size_t, double> NearTriangles::nearestTo(const Vector3& point) const {
  std::pair<std::size_t, double> nearest{0, std::numeric_limits<double>::infinity()};
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const double squared = bvh::squaredDistance(frames_[i], point);
    if (squared < nearest.second) nearest = {i, squared};
  }
  return nearest;
}

void NearTriangles::raise(double& squared, const Vector3& point) const {
  const auto frameOf = [&](std::size_t i) -> const bvh::TriangleFrame& { return frames_[i]; };
  squared = std::max(squared, bvh::leastSquaredDistance(frames_.size(), frameOf, point, squared));
}

}  // namespace hpsdf::contouring
