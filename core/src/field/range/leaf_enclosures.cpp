#include "field/range/leaf_enclosures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <variant>

#include "basis/coefficient_cube.h"
#include "field/query/evaluate.h"
#include "field/query/exact_leaf.h"
#include "hpsdf/detail/triangle_list.h"

namespace hpsdf::range {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

/// A leaf is halved at most so many times.
constexpr int kMostLevels = 2;
/// The greatest width of an enclosure, over its range, with which a polynomial is not halved. Boxes are often as small
/// as a part whose edge is more than `kLargePart` of the domain's, so that its own width matters.
constexpr double kFlat = 0.5;
constexpr double kLargeFlat = 0.125;
constexpr double kLargePart = 1.0 / 32;

/// Returns the distance from a point to a segment.
double distanceToSegment(const Vector3& x, const Vector3& from, const Vector3& to) {
  const Vector3 along = to - from;
  const double squared = along.squaredNorm();
  const double share = squared > 0 ? std::clamp((x - from).dot(along) / squared, 0.0, 1.0) : 0;
  return (x - from - share * along).norm();
}

/// Returns those edges of the listed triangles of an exact leaf that belong to one listed triangle only, as the
/// coordinates of their ends.
std::vector<std::pair<Vector3, Vector3>> openEdges(const ExactTriangles& exact, std::uint64_t leaf) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> count;
  forEachTriangle(exact, leaf, [&](std::uint32_t triangle) {
    const auto& corners = exact.triangles[triangle];
    for (int k = 0; k < 3; ++k) ++count[std::minmax(corners[k], corners[(k + 1) % 3])];
  });
  const auto vertex = [&](std::uint32_t index) {
    return std::visit([&](const auto& v) { return Vector3(v[index].template cast<double>()); }, exact.vertices);
  };
  std::vector<std::pair<Vector3, Vector3>> open;
  for (const auto& [ends, triangles] : count)
    if (triangles == 1) open.emplace_back(vertex(ends.first), vertex(ends.second));
  return open;
}

}  // namespace

/// An exact leaf, and what its parts need to know of it.
struct LeafEnclosures::ExactLeaf {
  std::uint64_t bits;
  std::array<double, 3> centre;  ///< grid coordinates
  double half;                   ///< half of the edge of the box in which the leaf has a weight, in grid coordinates
  double share;                  ///< see `LeafEnclosures::share`
  double noise;
  std::vector<std::pair<Vector3, Vector3>> open;  ///< see `openEdges`

  /// Returns true if the sign may be wrong, beyond the leaf's own box, at points whose nearest triangle is at most
  /// `reach` from x.
  bool mayLackSign(const Vector3& x, double reach) const {
    const ExactSign rule = node::exactSign(bits);
    if (rule == ExactSign::pseudonormal)
      return std::ranges::any_of(
          open, [&](const auto& edge) { return distanceToSegment(x, edge.first, edge.second) <= reach; });
    return rule == ExactSign::winding;
  }
};

void setAround(Enclosure& enclosure, const KnownDistance& known, double radius) {
  enclosure.min = known.value - radius;
  enclosure.max = known.value + radius;
  if (known.isSignUncertain) {
    const double distance = std::abs(known.value + known.offset) + radius;
    enclosure.min = -distance - known.offset;
    enclosure.max = distance - known.offset;
  }
}

LeafEnclosures::LeafEnclosures(const FieldData& field, const GridFrame& frame, const std::optional<Interval>& relevant)
    : field_(field),
      frame_(frame),
      relevant_(relevant),
      reach_(reachOf(field)),
      below_(detail::legendreOfPart(-0.5, 0.5, kMaxDegree)),
      above_(detail::legendreOfPart(0.5, 0.5, kMaxDegree)) {
  Box all = field.domain;
  std::visit(
      [&](const auto& vertices) {
        for (const auto& vertex : vertices) all.extend(vertex.template cast<double>());
      },
      field.exact.vertices);
  farthest_ = all.diagonal().norm();
  coordinateNoise_ = 8 * kEpsilon * (all.min().cwiseAbs().cwiseMax(all.max().cwiseAbs()).norm() + farthest_);
}

LeafEnclosure LeafEnclosures::operator()(const query::OctreeNode& leaf) const {
  LeafEnclosure found = node::isExact(field_.nodes[leaf.node]) ? ofExact(leaf) : ofPolynomial(leaf);
  if (!field_.bounds.empty()) found.whole.error = double(field_.bounds[leaf.node].error);
  for (PartGroup& group : found.groups)
    for (auto& part : group.parts) part->error = found.whole.error;
  return found;
}

namespace {

/// The range of a polynomial by the magnitudes of its terms.
struct TermRange {
  double middle;  ///< the constant term
  double spread;  ///< sum of the greatest magnitudes of all other terms
  double noise;   ///< greatest rounding error of a value
};

/// Returns the range over [−reach, reach]³. The recurrences of the Legendre polynomials up to degree p have errors of
/// about p² times the machine epsilon.
TermRange termRange(const double* coefficients, int degree, double reach) {
  std::array<double, kMaxDegree + 1> greatest;
  basis::legendreValues(reach, degree, greatest.data());
  double magnitude = 0;
  basis::forEachCoefficient(degree, [&](int i, int j, int k, int index) {
    magnitude += std::abs(coefficients[index]) * greatest[i] * greatest[j] * greatest[k];
  });
  const double middle = coefficients[0] * greatest[0] * greatest[0] * greatest[0];
  return {middle, magnitude - std::abs(middle), 256 * kEpsilon * (degree + 1) * (degree + 1) * magnitude};
}

/// Returns an enclosure by the terms' magnitudes alone, which says nothing of how the polynomial bends.
Enclosure wideEnclosure(const TermRange& range) {
  Enclosure wide;
  wide.min = wide.lower = range.middle - range.spread;
  wide.max = wide.upper = range.middle + range.spread;
  wide.bend = std::numeric_limits<double>::infinity();
  wide.noise = range.noise;
  return wide;
}

}  // namespace

LeafEnclosure LeafEnclosures::ofPolynomial(const query::OctreeNode& leaf) const {
  const std::uint64_t bits = field_.nodes[leaf.node];
  const int degree = node::degree(bits);
  std::array<double, coefficientCount(kMaxDegree)> coefficients;
  withCoefficients(field_, bits,
                   [&](const auto* c) { std::copy_n(c, coefficientCount(degree), coefficients.begin()); });
  const TermRange terms = termRange(coefficients.data(), degree, reach_);
  const double noise = terms.noise;
  const double farthest = terms.spread + noise;
  if (!isRelevant(terms.middle - farthest, terms.middle + farthest)) return {wideEnclosure(terms), {}};
  std::vector<double> cube = basis::cubeFrom(coefficients.data(), degree, degree);
  if (reach_ > 1) {
    const detail::LegendreRows rows = detail::legendreOfPart(0, reach_, degree);
    cube = basis::partCoefficients(std::move(cube), degree, {&rows, &rows, &rows});
  }
  LeafEnclosure found;
  found.whole = ofPart(cube, degree, kMostLevels, share(leaf), found);
  found.whole.gradient /= reach_;
  found.whole.bend /= reach_ * reach_;
  found.whole.noise = noise;
  for (PartGroup& group : found.groups)
    for (auto& part : group.parts) part->noise = noise;
  return found;
}

/// Returns the enclosure of a part of a leaf. Halves the part if it is not nearly linear, up to `levels` times, and
/// adds the halves to `found`. `cube` holds the polynomial's coefficients in local coordinates of the part, and `share`
/// is the edge of the part over that of the domain.
Enclosure LeafEnclosures::ofPart(const std::vector<double>& cube, int degree, int levels, double share,
                                 LeafEnclosure& found) const {
  Enclosure whole = enclosureOf(cube, degree);
  const double flat = share > kLargePart ? kLargeFlat : kFlat;
  if (levels == 0 || !isRelevant(whole.min, whole.max) || whole.upper - whole.lower <= flat * (whole.max - whole.min))
    return whole;
  const std::size_t index = found.groups.size();
  found.groups.emplace_back();
  for (int number = 0; number < 8; ++number) {
    std::array<const detail::LegendreRows*, 3> rows;
    for (int axis = 0; axis < 3; ++axis) rows[axis] = number >> axis & 1 ? &above_ : &below_;
    const auto next = static_cast<std::int32_t>(found.groups.size());
    const Enclosure part = ofPart(basis::partCoefficients(cube, degree, rows), degree, levels - 1, share / 2, found);
    found.groups[index].parts[number] = part;
    found.groups[index].groups[number] = std::size_t(next) < found.groups.size() ? next : PartGroup::kWhole;
  }
  tighten(whole, unionOf(found.groups[index].parts, {0.5, 0.5, 1}));
  return whole;
}

/// Returns the greatest ratio of a leaf's edge to the domain's along an axis.
double LeafEnclosures::share(const query::OctreeNode& leaf) const {
  return (query::cellSize(field_, leaf.depth).array() / field_.domain.sizes().array()).maxCoeff();
}

/// Beyond its own box, a leaf may give different distances in its eight octants, so that each must be a part of its
/// own.
int LeafEnclosures::levelsOfExact(const query::OctreeNode& leaf) const {
  int levels = reach_ > 1 ? 1 : 0;
  while (levels < kMostLevels && std::ldexp(share(leaf), -levels) > kLargePart) ++levels;
  return levels;
}

LeafEnclosure LeafEnclosures::ofExact(const query::OctreeNode& leaf) const {
  const std::uint64_t bits = field_.nodes[leaf.node];
  const double rounding = std::min(16 * kEpsilon * query::thinness(field_.exact, bits), 1.0);
  const double half = std::ldexp(0.5, -leaf.depth);
  ExactLeaf exact{.bits = bits, .centre = {}, .half = reach_ * half, .share = share(leaf), .noise = 0, .open = {}};
  for (int axis = 0; axis < 3; ++axis) exact.centre[axis] = (2 * static_cast<double>(leaf.cellIndex[axis]) + 1) * half;
  exact.noise = coordinateNoise_ + rounding * farthest_;
  if (reach_ > 1) exact.open = openEdges(field_.exact, bits);
  LeafEnclosure found;
  found.whole = ofExactPart(exact, Vector3::Zero(), 1, levelsOfExact(leaf), found);
  found.whole.gradient /= reach_;
  return found;
}

/// Adds the eight halves of a part of an exact leaf to `found`, and returns an enclosure of all of them.
Enclosure LeafEnclosures::ofExactHalves(const ExactLeaf& leaf, const Vector3& centre, double half, int levels,
                                        LeafEnclosure& found) const {
  const std::size_t index = found.groups.size();
  found.groups.emplace_back();
  for (int number = 0; number < 8; ++number) {
    Vector3 at = centre;
    for (int axis = 0; axis < 3; ++axis) at[axis] += (number >> axis & 1 ? 0.5 : -0.5) * half;
    const auto next = static_cast<std::int32_t>(found.groups.size());
    const Enclosure part = ofExactPart(leaf, at, half / 2, levels - 1, found);
    found.groups[index].parts[number] = part;
    found.groups[index].groups[number] = std::size_t(next) < found.groups.size() ? next : PartGroup::kWhole;
  }
  return unionOf(found.groups[index].parts, {0.5, 0.5, 1});
}

/// Returns the enclosure of a part of an exact leaf: the cube with this centre and half edge in coordinates in which
/// the leaf has a weight in [−1, 1]³. Halves the part `levels` times, and once more where the part is large and its
/// sign uncertain.
///
/// A distance to triangles is 1-Lipschitz, whichever triangles they are, and it keeps its sign as long as it is not 0
/// if the triangles bound a solid around the part. Beyond the leaf's own box, the list may lack triangles. Then the
/// sign by pseudonormals can only be wrong where the nearest edge or vertex lacks a neighbour, and the sign by winding
/// numbers can be wrong anywhere.
Enclosure LeafEnclosures::ofExactPart(const ExactLeaf& leaf, const Vector3& centre, double half, int levels,
                                      LeafEnclosure& found) const {
  if (levels > 0) return ofExactHalves(leaf, centre, half, levels, found);
  std::array<double, 3> coordinates;
  Vector3 extent;
  for (int axis = 0; axis < 3; ++axis) {
    coordinates[axis] = leaf.centre[axis] + leaf.half * centre[axis];
    extent[axis] = leaf.half * half / frame_.cells[axis] * frame_.size[axis];
  }
  const Vector3 x = query::worldPoint(frame_, coordinates);
  KnownDistance known{.offset = field_.exact.offset};
  query::evaluateExact(field_.exact, leaf.bits, query::octantOf({centre.x(), centre.y(), centre.z()}), {&x, 1},
                       &known.value);
  const double radius = extent.norm();
  const bool isBeyond = (centre.cwiseAbs().array() + half).maxCoeff() * reach_ > 1;
  known.isSignUncertain = isBeyond && leaf.mayLackSign(x, std::abs(known.value + known.offset) + 2 * radius);
  if (known.isSignUncertain && levels == 0 && half * leaf.share > kLargePart / 4)
    return ofExactHalves(leaf, centre, half, 0, found);
  Enclosure result;
  setAround(result, known, radius);
  result.lower = result.min;
  result.upper = result.max;
  result.noise = leaf.noise;
  result.isSignUncertain = known.isSignUncertain;
  return result;
}

}  // namespace hpsdf::range
