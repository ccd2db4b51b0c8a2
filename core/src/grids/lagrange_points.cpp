#include "grids/lagrange_points.h"

namespace hpsdf::grids {
namespace {

/// Appends the points of the lattice whose indices run from `first` to `last`, with i fastest.
void appendLattice(const PointIndex& first, const PointIndex& last, std::vector<PointIndex>& points) {
  for (int k = first[2]; k <= last[2]; ++k)
    for (int j = first[1]; j <= last[1]; ++j)
      for (int i = first[0]; i <= last[0]; ++i) points.push_back({i, j, k});
}

/// Appends the points within an edge along `axis` that contains the point `at`.
void appendEdge(PointIndex at, int axis, int order, std::vector<PointIndex>& points) {
  PointIndex first = at, last = at;
  first[axis] = 1;
  last[axis] = order - 1;
  appendLattice(first, last, points);
}

/// Appends the points within the face on which the index along `axis` is `level`.
void appendFace(int axis, int level, int order, std::vector<PointIndex>& points) {
  PointIndex first = {1, 1, 1}, last = {order - 1, order - 1, order - 1};
  first[axis] = last[axis] = level;
  appendLattice(first, last, points);
}

}  // namespace

std::vector<PointIndex> voxelPoints() {
  std::vector<PointIndex> points;
  appendLattice({0, 0, 0}, {1, 1, 1}, points);
  return points;
}

std::vector<PointIndex> lagrangePoints(int order) {
  const int n = order;
  const std::array<std::array<int, 2>, 4> around = {{{0, 0}, {n, 0}, {n, n}, {0, n}}};
  std::vector<PointIndex> points;
  for (const int k : {0, n})
    for (const auto& [i, j] : around) points.push_back({i, j, k});
  for (const int k : {0, n}) {
    appendEdge({0, 0, k}, 0, n, points);
    appendEdge({n, 0, k}, 1, n, points);
    appendEdge({0, n, k}, 0, n, points);
    appendEdge({0, 0, k}, 1, n, points);
  }
  for (const auto& [i, j] : around) appendEdge({i, j, 0}, 2, n, points);
  for (int axis = 0; axis < 3; ++axis)
    for (const int level : {0, n}) appendFace(axis, level, n, points);
  appendLattice({1, 1, 1}, {n - 1, n - 1, n - 1}, points);
  return points;
}

}  // namespace hpsdf::grids
