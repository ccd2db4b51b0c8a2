#include "field/cells/exact_leaves.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <span>
#include <utility>

#include "field/cells/exact_lists.h"

namespace hpsdf::detail {
namespace {

/// A plane that contains triangles up to the rounding of their vertices to float and to a tolerance.
struct CommonPlane {
  Vector3 origin, normal;
};

/// Returns the normal of a triangle with twice the triangle's area as its length.
Vector3 normalOf(const TriangleSearch& search, std::uint32_t triangle) {
  const auto& [a, b, c] = search.triangles()[triangle];
  const auto vertices = search.vertices();
  return (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
}

std::optional<CommonPlane> commonPlane(const TriangleSearch& search, std::span<const std::uint32_t> triangles,
                                       double tolerance) {
  const auto corner = [&](std::uint32_t triangle, int k) -> const Vector3& {
    return search.vertices()[search.triangles()[triangle][k]];
  };
  const std::uint32_t largest = *std::ranges::max_element(
      triangles, {}, [&](std::uint32_t triangle) { return normalOf(search, triangle).squaredNorm(); });
  if (!(normalOf(search, largest).norm() > 0)) return std::nullopt;
  const CommonPlane plane{corner(largest, 0), normalOf(search, largest).normalized()};
  for (const std::uint32_t triangle : triangles) {
    if (normalOf(search, triangle).dot(plane.normal) < 0) return std::nullopt;
    for (int k = 0; k < 3; ++k) {
      const Vector3& v = corner(triangle, k);
      const double size = v.cwiseAbs().maxCoeff() + plane.origin.cwiseAbs().maxCoeff();
      const double allowed = std::min(tolerance, std::numeric_limits<float>::epsilon() * size);
      if (std::abs((v - plane.origin).dot(plane.normal)) > allowed) return std::nullopt;
    }
  }
  return plane;
}

/// Returns true if all octants need much fewer triangles than the whole list has. Where many triangles meet at a
/// vertex, the octant with this vertex needs nearly all of them, and dividing the cell would repeat them at every
/// depth.
bool isShorterInOctants(const TriangleList& list) {
  constexpr double kShare = 0.6;
  std::array<std::size_t, 8> counts = {};
  for (const std::uint8_t octants : list.octants)
    for (int octant = 0; octant < 8; ++octant) counts[octant] += octants >> octant & 1;
  return double(*std::ranges::max_element(counts)) < kShare * double(list.triangles.size());
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

/// Returns the fit of a cell with these triangles, which were found for `box`; or std::nullopt if they do not determine
/// the sign.
std::optional<Fit> ExactCells::fitFrom(const Box& cell, const Box& box, TriangleList list) const {
  const std::optional<LeafSign> sign = search_.signIn(box, list.triangles);
  if (!sign) return std::nullopt;
  const auto plane =
      sign->rule == ExactSign::pseudonormal ? commonPlane(search_, list.triangles, planeTolerance_) : std::nullopt;
  Fit fit;
  if (plane) {
    fit = planeFit(cell, *plane);
  } else {
    fit.degree = kExactDegree;
    fit.list = std::move(list);
    fit.sign = *sign;
  }
  fit.isFinal = true;
  fit.error.volume = cell.volume();
  return fit;
}

ExactCells::Outcome ExactCells::makeExact(const Box& cell, bool isDivisible) const {
  constexpr std::size_t kLonger = 64;
  const Box box = boxOfWeight(cell, blend_);
  auto list = search_.nearestTo(box, isDivisible ? kLongerFactor * most_ : kLonger * most_);
  if (!list || (isDivisible && list->triangles.size() > most_ && isShorterInOctants(*list))) return {{}, isDivisible};
  std::optional<Fit> fit = fitFrom(cell, box, std::move(*list));
  if (fit) fit->error.near = true;
  return {std::move(fit), false};
}

bool ExactCells::isSmooth(const Box& cell) const {
  constexpr std::size_t kMost = 512;
  constexpr double kCosine = 0.95;  // of the greatest angle between a normal and the mean normal, 18 degrees
  const auto list = search_.nearestTo(boxOfWeight(cell, blend_), kMost);
  if (!list) return false;
  std::vector<Vector3> normals(list->triangles.size());
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = 0; i < normals.size(); ++i)
    sum += normals[i] = normalOf(search_, list->triangles[i]).normalized();
  const Vector3 mean = sum.normalized();
  return std::ranges::all_of(normals, [&](const Vector3& normal) { return normal.dot(mean) >= kCosine; });
}

std::optional<Fit> ExactCells::fitOfFarCell(const Box& cell, std::size_t mostTriangles) const {
  const Box box = boxOfWeight(cell, blend_);
  auto list = search_.nearestTo(box, mostTriangles);
  return list ? fitFrom(cell, box, std::move(*list)) : std::nullopt;
}

namespace {

enum class Choice : std::uint8_t { leave, keep, split };

/// Decides what becomes of a cell without a fit, and fits it if it stays whole.
Choice chooseForCell(BuildNode& node, const Box& box, const ExactCells& cells, const SmoothFit& smoothFit,
                     bool isDivisible) {
  ExactCells::Outcome outcome = chooseExact(box, cells, smoothFit, isDivisible);
  if (outcome.divides) return Choice::split;
  if (!outcome.fit) return Choice::leave;
  node.fit = std::move(*outcome.fit);
  return Choice::keep;
}

/// Splits the nodes for which this was chosen. Returns their children.
std::vector<std::uint32_t> splitChosen(BuildTree& tree, std::span<const std::uint32_t> nodes,
                                       std::span<const Choice> choices) {
  std::vector<std::uint32_t> children;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (choices[i] != Choice::split) continue;
    tree.split(nodes[i], {});
    for (std::uint32_t child = 0; child < 8; ++child) children.push_back(tree.nodes[nodes[i]].firstChild + child);
  }
  return children;
}

/// Decides what becomes of cells, and fits those that stay whole.
std::vector<Choice> chooseForCells(BuildTree& tree, std::span<const std::uint32_t> level, const ExactCells& cells,
                                   const SmoothFit& smoothFit, int maxDepth, const Progress& progress) {
  constexpr std::size_t kChunk = 1024;
  std::vector<Choice> choices(level.size());
  for (std::size_t begin = 0; begin < level.size(); begin += kChunk) {
    progress.update("finding exact cells", double(begin) / double(level.size()));
    tbb::parallel_for(begin, std::min(begin + kChunk, level.size()), [&](std::size_t i) {
      BuildNode& node = tree.nodes[level[i]];
      choices[i] = chooseForCell(node, tree.boxOf(node), cells, smoothFit, int(node.depth) < maxDepth);
    });
  }
  return choices;
}

/// Keeps a stratified random sample of the cells to be split, and leaves the others. Returns how many cells each one of
/// the sample stands for.
double sampleSplits(std::vector<Choice>& choices, std::mt19937& random) {
  constexpr std::size_t kStrata = 64;  // enough for numbers of leaves that are right within some 20 %
  std::vector<std::size_t> splits;
  for (std::size_t i = 0; i < choices.size(); ++i)
    if (choices[i] == Choice::split) splits.push_back(i);
  if (splits.size() <= kStrata) return 1;
  for (const std::size_t i : splits) choices[i] = Choice::leave;
  for (std::size_t stratum = 0; stratum < kStrata; ++stratum) {
    const std::size_t begin = splits.size() * stratum / kStrata, end = splits.size() * (stratum + 1) / kStrata;
    choices[splits[begin + random() % (end - begin)]] = Choice::split;
  }
  return double(splits.size()) / kStrata;
}

/// Returns the bytes of the lists of these nodes, and removes their fits.
double takeLists(BuildTree& tree, std::span<const std::uint32_t> level) {
  double bytes = 0;
  for (const std::uint32_t node : level) {
    bytes += bytesOf(tree.nodes[node].fit.list);
    tree.nodes[node].fit = {};
  }
  return bytes;
}

}  // namespace

ExactCells::Outcome chooseExact(const Box& cell, const ExactCells& cells, const SmoothFit& smoothFit,
                                bool isDivisible) {
  if (!cells.mustBeExact(cell)) return {};
  if (std::optional<Fit> smooth = smoothFit(cell)) return {std::move(smooth), false};
  return cells.makeExact(cell, isDivisible);
}

void placeExactLeaves(BuildTree& tree, const ExactCells& cells, const SmoothFit& smoothFit, int maxDepth,
                      const Progress& progress, const std::function<void(const ExactEstimate&)>& afterDepth) {
  std::vector<std::uint32_t> level;
  for (std::uint32_t n = 0; n < tree.nodes.size(); ++n)
    if (tree.nodes[n].firstChild == 0 && !tree.nodes[n].fit.isFinal) level.push_back(n);
  ExactEstimate size;
  while (!level.empty()) {
    const auto choices = chooseForCells(tree, level, cells, smoothFit, maxDepth, progress);
    for (const std::uint32_t node : level) size.listBytes += bytesOf(tree.nodes[node].fit.list);
    level = splitChosen(tree, level, choices);
    size.nodes = double(tree.nodes.size());
    afterDepth(size);
  }
}

ExactEstimate estimateExactLeaves(BuildTree&& baseCells, const ExactCells& cells, int maxDepth, double mostNodes,
                                  const Progress& progress) {
  const SmoothFit none = [](const Box&) { return std::nullopt; };
  BuildTree sample = std::move(baseCells);
  std::vector<std::uint32_t> level(sample.nodes.size());
  std::iota(level.begin(), level.end(), 0U);
  ExactEstimate estimate{.nodes = double(level.size()), .overestimate = kOverestimateBySamples};
  std::mt19937 random;  // always with the same seed: the estimate is the same for any number of threads
  double each = 1;      // number of cells that each cell of the sample stands for
  while (!level.empty() && estimate.nodes <= mostNodes) {
    auto choices = chooseForCells(sample, level, cells, none, maxDepth, progress);
    estimate.listBytes += each * takeLists(sample, level);
    each *= sampleSplits(choices, random);
    level = splitChosen(sample, level, choices);
    estimate.nodes += each * double(level.size());
  }
  return estimate;
}

}  // namespace hpsdf::detail
