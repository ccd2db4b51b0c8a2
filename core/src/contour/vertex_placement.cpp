#include "contour/vertex_placement.h"

#include <algorithm>
#include <array>

#include "contour/cells/bisection.h"
#include "contour/cells/meeting_point.h"
#include "contour/cells/projection.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr std::size_t kSheetsAtOnce = 256;

/// Returns the box in which the vertices of a leaf may lie. It leaves a margin, so that vertices of neighbours never
/// coincide. The margin is so narrow that it keeps no vertex farther from the surface than `accuracy`.
Box roomOf(const ContourOctree& octree, std::int32_t leaf, double accuracy) {
  constexpr double kFromFaces = 1e-3;
  const Box box = octree.box(octree[leaf]);
  const Vector3 margin = Vector3::Constant(std::min(kFromFaces * octree.edge(octree[leaf]), accuracy / 2));
  return Box(Vector3(box.min() + margin), Vector3(box.max() - margin));
}

/// Fills `planes` with the tangent planes at a sheet's crossings.
void listPlanes(const Sheets& sheets, std::uint32_t sheet, std::span<const CrossedEdge> edges,
                std::vector<TangentPlane>& planes) {
  planes.clear();
  for (const std::uint32_t e : sheets.edgesOf(sheet)) planes.push_back({edges[e].point, edges[e].normal});
}

}  // namespace

Vector3 middleOf(const Sheets& sheets, std::uint32_t sheet, std::span<const CrossedEdge> edges) {
  std::vector<TangentPlane> planes;
  listPlanes(sheets, sheet, edges, planes);
  return middleOf(planes);
}

void placeVertices(const ImplicitSurface& surface, const ContourOctree& octree, std::span<const CrossedEdge> edges,
                   const Sheets& sheets, std::span<const std::uint32_t> chosen, double accuracy,
                   const Progress& progress, std::vector<Vector3>& vertices) {
  detail::forEachChunk(chosen.size(), kSheetsAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.throwIfCancelled();
    std::array<Box, kSheetsAtOnce> rooms;
    std::array<Vector3, kSheetsAtOnce> memory;
    const std::span placed = std::span(memory).first(count);
    std::vector<TangentPlane> planes;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t sheet = chosen[first + i];
      rooms[i] = roomOf(octree, sheets.cellOf(sheet), accuracy);
      listPlanes(sheets, sheet, edges, planes);
      const Vector3 middle = middleOf(planes), meeting = meetingPointOf(planes, middle);
      const Vector3 start = rooms[i].contains(meeting) ? meeting : middle;
      placed[i] = start.cwiseMax(rooms[i].min()).cwiseMin(rooms[i].max());
    }
    std::array<double, kSheetsAtOnce> magnitudes;
    projectOntoSurface(surface, accuracy, placed, std::span(magnitudes).first(count), std::span(rooms).first(count));
    for (std::size_t i = 0; i < count; ++i)
      vertices[chosen[first + i]] =
          magnitudes[i] > accuracy ? bisected(surface, rooms[i], placed[i], accuracy) : placed[i];
  });
}

}  // namespace hpsdf::contouring
