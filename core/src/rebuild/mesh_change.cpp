#include "rebuild/mesh_change.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "mesh/connectivity.h"

namespace hpsdf::rebuilding {
namespace {

/// Compares points by their coordinates, in which −0 equals 0.
bool isLess(const Vector3& a, const Vector3& b) {
  return std::tuple(a.x(), a.y(), a.z()) < std::tuple(b.x(), b.y(), b.z());
}

using Corners = std::array<Vector3, 3>;

/// The corners of a mesh's triangles, each beginning with the least one, and the triangles sorted by them.
class SortedTriangles {
 public:
  explicit SortedTriangles(const TriangleMesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    tbb::parallel_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      const Corners first = cornersAt(a), second = cornersAt(b);
      return isLess(first, second) || (!isLess(second, first) && a < b);
    });
  }

  std::size_t size() const { return order_.size(); }
  Corners operator[](std::size_t i) const { return cornersAt(order_[i]); }
  static bool isLess(const Corners& a, const Corners& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), rebuilding::isLess);
  }

 private:
  Corners cornersAt(std::uint32_t triangle) const {
    Corners corners = cornersOf(mesh_, mesh_.triangles[triangle]);
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end(), rebuilding::isLess), corners.end());
    return corners;
  }

  const TriangleMesh& mesh_;
  std::vector<std::uint32_t> order_;
};

/// Collects triangles into a mesh in which equal vertices are one.
class Collected {
 public:
  void add(const Corners& corners) {
    Triangle triangle;
    for (int k = 0; k < 3; ++k) {
      const auto [at, isNew] = numbers_.try_emplace(corners[k], std::uint32_t(mesh_.vertices.size()));
      if (isNew) mesh_.vertices.push_back(corners[k]);
      triangle[k] = at->second;
    }
    mesh_.triangles.push_back(triangle);
  }
  TriangleMesh take() { return std::move(mesh_); }

 private:
  TriangleMesh mesh_;
  std::map<Vector3, std::uint32_t, decltype(&rebuilding::isLess)> numbers_{&rebuilding::isLess};
};

/// Calls f(corners) for each triangle of `one` that `other` has not, or has less often.
template <typename F>
void forEachOnlyIn(const SortedTriangles& one, const SortedTriangles& other, const F& f) {
  for (std::size_t i = 0, k = 0; i < one.size(); ++i) {
    const Corners corners = one[i];
    while (k < other.size() && SortedTriangles::isLess(other[k], corners)) ++k;
    if (k < other.size() && !SortedTriangles::isLess(corners, other[k]))
      ++k;
    else
      f(corners);
  }
}

}  // namespace

bool hasHoles(const TriangleMesh& mesh) {
  bool has = false;
  mesh::forEachEdge(mesh::directedEdgesOf(mesh.triangles), [&](std::span<const mesh::DirectedEdge> edge) {
    const auto rising = std::ranges::count_if(edge, &mesh::DirectedEdge::rising);
    has = has || 2 * std::size_t(rising) != edge.size();
  });
  return has;
}

MeshChange changeBetween(const TriangleMesh& before, const TriangleMesh& after) {
  const SortedTriangles first(before), second(after);
  Collected collected;
  MeshChange change;
  forEachOnlyIn(first, second, [&](const Corners& corners) {
    collected.add({corners[0], corners[2], corners[1]});
    ++change.removed;
  });
  forEachOnlyIn(second, first, [&](const Corners& corners) { collected.add(corners); });
  change.triangles = collected.take();
  change.triangles.name = after.name;
  return change;
}

}  // namespace hpsdf::rebuilding
