#include "field/cells/exact_leaves.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "field/cells/exact_lists.h"

namespace hpsdf::detail {
namespace {

/// A plane that contains triangles up to the rounding of their vertices to float.
struct CommonPlane {
  Vector3 origin, normal;
};

std::optional<CommonPlane> commonPlane(const TriangleSearch& search, std::span<const std::uint32_t> triangles) {
  const auto corner = [&](std::uint32_t triangle, int k) -> const Vector3& {
    return search.vertices()[search.triangles()[triangle][k]];
  };
  const auto normalOf = [&](std::uint32_t triangle) -> Vector3 {
    return (corner(triangle, 1) - corner(triangle, 0)).cross(corner(triangle, 2) - corner(triangle, 0));
  };
  const std::uint32_t largest = *std::ranges::max_element(
      triangles, {}, [&](std::uint32_t triangle) { return normalOf(triangle).squaredNorm(); });
  if (!(normalOf(largest).norm() > 0)) return std::nullopt;
  const CommonPlane plane{corner(largest, 0), normalOf(largest).normalized()};
  for (const std::uint32_t triangle : triangles) {
    if (normalOf(triangle).dot(plane.normal) < 0) return std::nullopt;
    for (int k = 0; k < 3; ++k) {
      const Vector3& v = corner(triangle, k);
      const double size = v.cwiseAbs().maxCoeff() + plane.origin.cwiseAbs().maxCoeff();
      if (std::abs((v - plane.origin).dot(plane.normal)) > std::numeric_limits<float>::epsilon() * size)
        return std::nullopt;
    }
  }
  return plane;
}

/// Returns the fit of degree 1 that is the signed distance to a plane.
Fit planeFit(const Box& cell, const CommonPlane& plane) {
  Fit fit;
  fit.degree = 1;
  const Vector3 slope = plane.normal.cwiseProduct(cell.sizes() / 2);
  fit.coefficients = {plane.normal.dot(cell.center() - plane.origin), slope.z(), slope.y(), slope.x()};
  return fit;
}

}  // namespace

ExactCells::Outcome ExactCells::makeExact(const Box& cell, bool isDivisible) const {
  constexpr std::size_t kLonger = 64;
  // Lists without a sign contain triangles that intersect others. Cells with so short lists are not divided further.
  constexpr std::size_t kFew = 8;
  const Box box = boxOfWeight(cell, blend_);
  auto triangles = search_.nearestTo(box, isDivisible ? most_ : kLonger * most_);
  if (!triangles) return {{}, isDivisible};
  const std::optional<ExactSign> sign = search_.signIn(box, *triangles);
  if (!sign) return {{}, isDivisible && triangles->size() > kFew};
  Fit fit;
  const auto plane = *sign == ExactSign::pseudonormal ? commonPlane(search_, *triangles) : std::nullopt;
  if (plane) {
    fit = planeFit(cell, *plane);
  } else {
    fit.degree = kExactDegree;
    fit.triangles = std::move(*triangles);
    fit.sign = *sign;
  }
  fit.isFinal = true;
  fit.error.volume = cell.volume();
  fit.error.near = true;
  return {std::move(fit), false};
}

void placeExactLeaves(BuildTree& tree, const ExactCells& cells, int maxDepth, const Progress& progress) {
  constexpr std::size_t kChunk = 1024;
  enum class Choice : std::uint8_t { leave, exact, split };
  std::vector<std::uint32_t> level(tree.nodes.size());
  for (std::uint32_t n = 0; n < level.size(); ++n) level[n] = n;
  for (int depth = 0; !level.empty(); ++depth) {
    std::vector<Choice> choices(level.size(), Choice::leave);
    for (std::size_t begin = 0; begin < level.size(); begin += kChunk) {
      progress.update("finding exact cells", double(begin) / double(level.size()));
      tbb::parallel_for(begin, std::min(begin + kChunk, level.size()), [&](std::size_t i) {
        BuildNode& node = tree.nodes[level[i]];
        const Box box = tree.boxOf(node);
        if (!cells.mustBeExact(box)) return;
        ExactCells::Outcome outcome = cells.makeExact(box, depth < maxDepth);
        if (outcome.fit) node.fit = std::move(*outcome.fit);
        if (outcome.fit || outcome.divides) choices[i] = outcome.divides ? Choice::split : Choice::exact;
      });
    }
    std::vector<std::uint32_t> next;
    for (std::size_t i = 0; i < level.size(); ++i) {
      if (choices[i] != Choice::split) continue;
      tree.split(level[i], {});
      for (std::uint32_t child = 0; child < 8; ++child) next.push_back(tree.nodes[level[i]].firstChild + child);
    }
    level = std::move(next);
  }
}

}  // namespace hpsdf::detail
