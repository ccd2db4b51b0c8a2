#include "contour/vertex_placement.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr std::size_t kSheetsAtOnce = 256;

/// Returns the box in which the vertices of a leaf may lie. It leaves a margin, so that vertices of neighbours never
/// coincide, not even in files of single precision. The margin is so narrow that it keeps no vertex farther from the
/// surface than `accuracy`.
Box roomOf(const ContourOctree& octree, std::int32_t leaf, double accuracy) {
  constexpr double kFromFaces = 1e-3;
  const Box box = octree.box(octree[leaf]);
  const Vector3 margin = Vector3::Constant(std::min(kFromFaces * octree.edge(octree[leaf]), accuracy / 2));
  return Box(Vector3(box.min() + margin), Vector3(box.max() - margin));
}

/// Returns the point with the least sum of squared distances to the planes through the sheet's crossings, as far from
/// their middle as they determine it (Ju et al. 2002; Lindstrom 2000 for the pseudoinverse).
Vector3 meetingPoint(const Sheets& sheets, std::uint32_t sheet, std::span<const CrossedEdge> edges) {
  // Directions in which the planes differ less than this hardly determine the point. The number is the square of the
  // sine of half the angle between two planes at a sharp edge, about 8 degrees.
  constexpr double kSharp = 0.005;
  const Vector3 middle = middleOf(sheets, sheet, edges);
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  Vector3 right = Vector3::Zero();
  for (const std::uint32_t e : sheets.edgesOf(sheet)) {
    const Vector3& normal = edges[e].normal;
    squares += normal * normal.transpose();
    right += normal * normal.dot(edges[e].point - middle);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares);
  const double count = double(sheets.edgesOf(sheet).size());
  Vector3 step = Vector3::Zero();
  for (int k = 0; k < 3; ++k) {
    const double eigenvalue = solver.eigenvalues()[k];
    const Vector3 direction = solver.eigenvectors().col(k);
    if (eigenvalue > kSharp * count) step += direction * (direction.dot(right) / eigenvalue);
  }
  return middle + step;
}

/// Moves points along the gradient towards the zero set, within their rooms.
void project(const ImplicitSurface& surface, std::span<Vector3> points, std::span<const Box> rooms, double accuracy) {
  constexpr int kMostSteps = 6;
  std::array<Vector3, kSheetsAtOnce> tried, best;
  std::array<double, kSheetsAtOnce> bestValue;
  std::array<ValueAndGradient, kSheetsAtOnce> found;
  const std::size_t count = points.size();
  std::fill_n(bestValue.begin(), count, std::numeric_limits<double>::infinity());
  std::ranges::copy(points, tried.begin());
  for (int step = 0; step <= kMostSteps; ++step) {
    surface.valuesAndGradients(std::span(tried).first(count), std::span(found).first(count));
    bool moves = false;
    for (std::size_t i = 0; i < count; ++i) {
      const auto& [value, gradient] = found[i];
      if (std::abs(value) < bestValue[i]) {
        bestValue[i] = std::abs(value);
        best[i] = tried[i];
      }
      const double squared = gradient.squaredNorm();
      if (bestValue[i] <= accuracy || !(squared > 0.01)) continue;
      moves = true;
      tried[i] = (tried[i] - gradient * (value / squared)).cwiseMax(rooms[i].min()).cwiseMin(rooms[i].max());
    }
    if (!moves) break;
  }
  std::copy_n(best.begin(), count, points.begin());
}

}  // namespace

Vector3 middleOf(const Sheets& sheets, std::uint32_t sheet, std::span<const CrossedEdge> edges) {
  Vector3 sum = Vector3::Zero();
  for (const std::uint32_t e : sheets.edgesOf(sheet)) sum += edges[e].point;
  return sum / double(sheets.edgesOf(sheet).size());
}

std::vector<Vector3> placeVertices(const ImplicitSurface& surface, const ContourOctree& octree,
                                   std::span<const CrossedEdge> edges, const Sheets& sheets, double accuracy,
                                   const Progress& progress) {
  std::vector<Vector3> vertices(sheets.size());
  detail::forEachChunk(sheets.size(), kSheetsAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    progress.throwIfCancelled();
    std::array<Box, kSheetsAtOnce> rooms;
    for (std::size_t i = 0; i < count; ++i) {
      const auto sheet = static_cast<std::uint32_t>(first + i);
      rooms[i] = roomOf(octree, sheets.cellOf(sheet), accuracy);
      const Vector3 meeting = meetingPoint(sheets, sheet, edges);
      const Vector3 start = rooms[i].contains(meeting) ? meeting : middleOf(sheets, sheet, edges);
      vertices[sheet] = start.cwiseMax(rooms[i].min()).cwiseMin(rooms[i].max());
    }
    project(surface, std::span(vertices).subspan(first, count), std::span(rooms).first(count), accuracy);
  });
  return vertices;
}

}  // namespace hpsdf::contouring
