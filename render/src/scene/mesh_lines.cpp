#include "scene/mesh_lines.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "scene/line_painter.h"
#include "view/grid_space.h"

namespace hpsdf::render {
namespace {

using MeshEdge = std::pair<std::uint32_t, std::uint32_t>;  // indices of its vertices, the smaller one first

bool facesEye(const Camera& camera, const std::array<Vector3, 3>& corners) {
  const Vector3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  return normal.dot(camera.projection == Projection::orthographic ? camera.forward : corners[0] - camera.eye) < 0;
}

/// Returns the edges of the triangles that face the eye, each once.
std::vector<MeshEdge> edgesTowards(const Camera& camera, const TriangleMesh& mesh) {
  std::vector<MeshEdge> edges;
  for (const Triangle& triangle : mesh.triangles) {
    if (!facesEye(camera, cornersOf(mesh, triangle))) continue;
    for (int k = 0; k < 3; ++k) edges.push_back(std::minmax({triangle[k], triangle[(k + 1) % 3]}));
  }
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

/// Returns the part of a line that the view's clipping plane does not remove, or std::nullopt if nothing remains.
std::optional<SpaceLine> clipped(SpaceLine line, const SurfaceView& view) {
  if (!view.clip) return line;
  const auto [axis, offset] = *view.clip;
  const double side = eyeAbove(view.camera, *view.clip) ? 1 : -1;
  const double a = side * (line.a[axis] - offset), b = side * (line.b[axis] - offset);  // above 0 if removed
  if (a >= 0 && b >= 0) return std::nullopt;
  if (a > 0 || b > 0) (a > 0 ? line.a : line.b) = line.a + a / (a - b) * (line.b - line.a);
  return line;
}

}  // namespace

std::vector<float> meshLines(const TriangleMesh& mesh, double tolerance, const Box& domain, const SurfaceView& view,
                             const ViewBuffers& buffers, double lineWidth) {
  const LineStyle style{
      .fullLength = 10, .goneLength = 2, .leastStrength = 0.3F, .farthestStrength = 0.6, .slack = 2 * tolerance};
  std::vector<SpaceLine> lines;
  for (const auto& [from, to] : edgesTowards(view.camera, mesh)) {
    const Vector3 &a = mesh.vertices[from], &b = mesh.vertices[to];
    if (const auto line = clipped({a, b, (b - a).norm()}, view)) lines.push_back(*line);
  }
  return LinePainter(view.camera, domain, buffers, lineWidth, style).coverage(lines);
}

}  // namespace hpsdf::render
