#include "field/continuity/face_coupling.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "basis/legendre.h"
#include "basis/projection.h"
#include "field/query/blend.h"
#include "field/query/evaluate.h"
#include "hpsdf/error.h"
#include "util/chunks.h"

namespace hpsdf::continuity {
namespace {

constexpr std::size_t kLeavesPerTask = 256;

/// Returns the number of coefficients of a polynomial in two variables with the given total degree.
constexpr std::size_t faceCoefficientCount(int degree) { return std::size_t(degree + 1) * (degree + 2) / 2; }
/// Returns the index of a coefficient on a face. Its basis function is the product of the Legendre polynomials of
/// degrees a and b along the face's two axes.
constexpr std::size_t faceIndex(int a, int b) { return std::size_t(a + b) * (a + b + 1) / 2 + b; }
constexpr std::size_t kMaxFaceCoefficients = faceCoefficientCount(kMaxDegree);

/// Restricts a polynomial on a face to a quarter of the face. In one dimension, P_i = Σ_a share_[h][i][a] Q_a on half h
/// of an interval. P_i and Q_a are the orthonormal Legendre polynomials of the interval and of the half.
class QuarterRestriction {
 public:
  QuarterRestriction() {
    const std::array<detail::LegendreRows, 2> shares = basis::halfShares();
    for (int half = 0; half < 2; ++half)
      for (int i = 0; i <= kMaxDegree; ++i)
        for (int a = 0; a <= i; ++a)
          share_[half][i][a] = 2 * std::sqrt((2 * a + 1.0) / (2 * i + 1)) * shares[half][i][a];
  }

  /// Replaces the coefficients of a polynomial on a face by its coefficients on a quarter of the face. Bit 0 of
  /// `quarter` selects the lower or upper half (0 or 1) along the first axis of the face, bit 1 along the second axis.
  template <typename Degree>
  void apply(double* face, Degree degree, int quarter) const {
    for (int along = 0; along < 2; ++along) {
      const auto& share = share_[quarter >> along & 1];
      for (int b = 0; b <= degree; ++b)
        for (int a = 0; a <= degree - b; ++a) {  // ascending, because sum a needs the old coefficients from a upwards
          double sum = 0;
          for (int i = a; i <= degree - b; ++i) sum += share[i][a] * at(face, along, i, b);
          at(face, along, a, b) = sum;
        }
    }
  }

  template <typename Degree>
  void applyTransposed(double* face, Degree degree, int quarter) const {
    for (int along = 0; along < 2; ++along) {
      const auto& share = share_[quarter >> along & 1];
      for (int b = 0; b <= degree; ++b)
        for (int i = degree - b; i >= 0; --i) {
          double sum = 0;
          for (int a = 0; a <= i; ++a) sum += share[i][a] * at(face, along, a, b);
          at(face, along, i, b) = sum;
        }
    }
  }

 private:
  static double& at(double* face, int along, int a, int b) {
    return face[along == 0 ? faceIndex(a, b) : faceIndex(b, a)];
  }

  std::array<std::array<std::array<double, kMaxDegree + 1>, kMaxDegree + 1>, 2> share_{};
};

const QuarterRestriction kQuarterRestriction;

/// Computes a leaf's polynomial on one of its faces, like `FaceCoupling::Trace`, for a degree and an axis that
/// are known at compile time. The compiler therefore unrolls the loops.
template <int P, int Axis>
struct KnownTrace {
  static constexpr int kCount = coefficientCount(P);
  struct Entry {
    std::uint8_t faceIndex;
    std::uint8_t order;  ///< degree along the axis perpendicular to the face
  };
  static constexpr std::array<Entry, kCount> kEntries = [] {
    std::array<Entry, kCount> entries{};
    int index = 0;
    for (int i = 0; i <= P; ++i)
      for (int j = 0; j <= P - i; ++j)
        for (int k = 0; k <= P - i - j; ++k) {
          const std::array<int, 3> order{i, j, k};
          entries[index++] = {static_cast<std::uint8_t>(faceIndex(order[Axis == 0], order[Axis == 2 ? 1 : 2])),
                              static_cast<std::uint8_t>(order[Axis])};
        }
    return entries;
  }();

  /// Computes the coefficients on a face from the leaf's coefficients x. `ends[i]` is the value of the
  /// one-dimensional orthonormal polynomial of degree i at the face.
  static void apply(const double* ends, const double* x, double* face) {
    std::array<double, faceCoefficientCount(P)> sums{};
    [&]<std::size_t... C>(std::index_sequence<C...>) {
      ((sums[kEntries[C].faceIndex] += ends[kEntries[C].order] * x[C]), ...);
    }
    (std::make_index_sequence<kCount>());
    for (std::size_t a = 0; a < sums.size(); ++a) face[a] = sums[a];
  }

  /// Adds scale·Tᵀ·face to `out`. The matrix T maps the coefficients of a leaf to the coefficients on a face, see
  /// `apply`.
  static void addTransposed(const double* ends, double scale, const double* face, double* out) {
    std::array<double, faceCoefficientCount(P)> scaled;
    for (std::size_t a = 0; a < scaled.size(); ++a) scaled[a] = scale * face[a];
    [&]<std::size_t... C>(std::index_sequence<C...>) {
      ((out[C] += ends[kEntries[C].order] * scaled[kEntries[C].faceIndex]), ...);
    }
    (std::make_index_sequence<kCount>());
  }
};

/// The values of the one-dimensional orthonormal Legendre polynomials at the lower (0) and the upper (1) end of
/// an axis.
const auto kEndValues = [] {
  std::array<std::array<double, kMaxDegree + 1>, 2> values{};
  for (int i = 0; i <= kMaxDegree; ++i) {
    values[1][i] = std::sqrt(2 * i + 1.0);
    values[0][i] = i % 2 == 0 ? values[1][i] : -values[1][i];
  }
  return values;
}();

template <int P, typename F>
bool withAxis(int axis, const F& f) {
  if (axis == 0) f(KnownTrace<P, 0>());
  if (axis == 1) f(KnownTrace<P, 1>());
  if (axis == 2) f(KnownTrace<P, 2>());
  return true;
}

/// Calls f with a `KnownTrace` if the degree is one that most leaves have, 2 to 5. Returns true if f was called.
template <typename F>
bool withKnownTrace(int degree, int axis, const F& f) {
  switch (degree) {
    case 2:
      return withAxis<2>(axis, f);
    case 3:
      return withAxis<3>(axis, f);
    case 4:
      return withAxis<4>(axis, f);
    case 5:
      return withAxis<5>(axis, f);
    default:
      return false;
  }
}

int quarterOf(const std::array<std::uint32_t, 2>& along, int level) {
  return static_cast<int>((along[0] >> level & 1) | (along[1] >> level & 1) << 1);
}

/// Returns true for the linear polynomials that strategy hpx makes where the surface is plane. They are as exact as
/// exact leaves, and linear polynomials of slope 1 up to rounding. A fit of slope 1 is as exact.
bool isDistanceToPlane(const FieldData& field, const query::OctreeNode& leaf) {
  constexpr double kRounding = 1e-6;  // of coefficients that were rounded to float once
  const std::uint64_t bits = field.nodes[leaf.node];
  if (field.metadata.settings.strategy != Strategy::hpx || node::degree(bits) != 1) return false;
  const double* c = query::leafOf(std::get<FieldArray<double>>(field.coefficients), bits);
  const Vector3 slope = 2 * Vector3(c[3], c[2], c[1]).cwiseQuotient(query::cellSize(field, leaf.depth));
  return std::abs(slope.norm() - 1) <= kRounding;
}

}  // namespace

/// Gauss points along the axes of a face, with which traces of fixed leaves are projected onto polynomials of a degree.
struct FaceCoupling::FaceSamples {
  int degree;
  std::vector<double> points;
  std::vector<std::array<double, kMaxDegree + 1>> weighted;  ///< by point: half of its weight times each basis function

  explicit FaceSamples(int itsDegree) : degree(itsDegree) {
    const basis::QuadratureRule rule = basis::gaussLegendre(std::max(degree, query::kExactSampleDegree) + 1);
    points = rule.points;
    weighted.resize(points.size());
    for (std::size_t s = 0; s < points.size(); ++s) {
      basis::legendreValues(points[s], degree, weighted[s].data());
      for (int i = 0; i <= degree; ++i) weighted[s][i] *= std::sqrt(2 * i + 1.0) * rule.weights[s] / 2;
    }
  }

  /// Adds the part of the point (s0, s1), at which the trace has this value, to the coefficients on a face.
  void project(std::size_t s0, std::size_t s1, double value, double* face) const {
    for (int a = 0; a <= degree; ++a)
      for (int b = 0; b <= degree - a; ++b) face[faceIndex(a, b)] += value * weighted[s0][a] * weighted[s1][b];
  }
};

FaceCoupling::FaceCoupling(const FieldData& field) : leaves_(query::allLeaves(field)) {
  start_.push_back(0);
  for (const query::OctreeNode& leaf : leaves_) {
    const std::uint64_t bits = field.nodes[leaf.node];
    degree_.push_back(static_cast<std::uint8_t>(node::degree(bits)));
    isFixed_.push_back(node::isExact(bits) || isDistanceToPlane(field, leaf));
    start_.push_back(start_.back() + (node::isExact(bits) ? 0 : coefficientCount(degree_.back())));
  }
  if (start_.back() > 0xffffffffu)
    throw Error("the field needs " + std::to_string(start_.back()) +
                " coefficients, more than 2^32; raise the target error");
  const double baseCells = double(field.grid[0]) * field.grid[1] * field.grid[2];
  for (int depth = 0; depth <= kMaxDepth; ++depth) scale_.push_back(std::sqrt(std::ldexp(1.0, -3 * depth) / baseCells));
  makeTraces();
  linkLeaves(field);
  groupLinksByLeaf();
  findFixedPart(field);
}

void FaceCoupling::makeTraces() {
  for (const std::uint8_t degree : degree_) {
    if (degree == kExactDegree || !traces_[degree][0].faceIndex.empty()) continue;
    basis::forEachCoefficient(degree, [&](int i, int j, int k, int) {
      const std::array<int, 3> order{i, j, k};
      for (int axis = 0; axis < 3; ++axis) {
        Trace& trace = traces_[degree][axis];
        trace.faceIndex.push_back(static_cast<std::uint16_t>(faceIndex(order[axis == 0], order[axis == 2 ? 1 : 2])));
        for (int side = 0; side < 2; ++side) trace.factor[side].push_back(kEndValues[side][order[axis]]);
      }
    });
  }
}

void FaceCoupling::linkLeaves(const FieldData& field) {
  std::vector<std::uint32_t> leafOfNode(field.nodes.size());
  for (std::size_t n = 0; n < leaves_.size(); ++n) leafOfNode[leaves_[n].node] = static_cast<std::uint32_t>(n);
  const auto linkChunk = [&](std::vector<Link>& links, std::size_t first, std::size_t count) {
    for (std::size_t n = first; n < first + count; ++n)
      query::forEachInterface(field, leaves_[n], [&](int axis, int step, const query::OctreeNode& large) {
        if (isFixed_[n] && isFixed_[leafOfNode[large.node]]) return;
        Link& link = links.emplace_back(Link{.small = static_cast<std::uint32_t>(n),
                                             .large = leafOfNode[large.node],
                                             .along = {},
                                             .axis = static_cast<std::uint8_t>(axis),
                                             .levels = static_cast<std::uint8_t>(leaves_[n].depth - large.depth),
                                             .side = static_cast<std::uint8_t>(step > 0)});
        const std::array<int, 2> axes{axis == 0 ? 1 : 0, axis == 2 ? 1 : 2};
        for (int a = 0; a < 2; ++a)
          link.along[a] =
              static_cast<std::uint32_t>(leaves_[n].cellIndex[axes[a]] - (large.cellIndex[axes[a]] << link.levels));
      });
  };
  links_ = detail::listOfChunks<Link>(leaves_.size(), kLeavesPerTask, {}, "", linkChunk);
  jumpStart_.push_back(0);
  for (const Link& link : links_) jumpStart_.push_back(jumpStart_.back() + faceCoefficientCount(faceDegree(link)));
  jumps_.resize(jumpStart_.back());
}

/// Returns the degree of the jump across a face, as far as it depends on polynomials.
int FaceCoupling::faceDegree(const Link& link) const {
  const int small = degree_[link.small], large = degree_[link.large];
  if (isFixed_[link.small]) return large;
  return isFixed_[link.large] ? small : std::max(small, large);
}

void FaceCoupling::groupLinksByLeaf() {
  if (links_.size() > 0xffffffffu)
    throw Error("the field has more than 2^32 faces between its cells; raise the target error");
  linksOfLeafStart_.assign(leaves_.size() + 1, 0);
  for (const Link& link : links_)
    for (const std::uint32_t leaf : {link.small, link.large}) ++linksOfLeafStart_[leaf + 1];
  std::partial_sum(linksOfLeafStart_.begin(), linksOfLeafStart_.end(), linksOfLeafStart_.begin());
  linksOfLeaf_.resize(2 * links_.size());
  std::vector<std::size_t> next(linksOfLeafStart_.begin(), linksOfLeafStart_.end() - 1);
  for (std::size_t n = 0; n < links_.size(); ++n)
    for (const std::uint32_t leaf : {links_[n].small, links_[n].large})
      linksOfLeaf_[next[leaf]++] = static_cast<std::uint32_t>(n);
}

std::vector<double> FaceCoupling::toUnknowns(const FieldData& field) const {
  const std::span<const double> coefficients = std::get<FieldArray<double>>(field.coefficients).all();
  std::vector<double> x(start_.back());
  for (std::size_t n = 0; n < leaves_.size(); ++n) {
    if (degree_[n] == kExactDegree) continue;
    const double* c = &coefficients[node::offset(field.nodes[leaves_[n].node])];
    basis::forEachCoefficient(degree_[n], [&](int i, int j, int k, int index) {
      x[start_[n] + index] = c[index] * scale_[leaves_[n].depth] * std::sqrt(basis::squaredNorm(i, j, k));
    });
  }
  return x;
}

void FaceCoupling::fromUnknowns(std::span<const double> x, FieldData& field) const {
  std::vector<double> coefficients(start_.back());
  for (std::size_t n = 0; n < leaves_.size(); ++n) {
    if (degree_[n] == kExactDegree) continue;
    field.nodes[leaves_[n].node] = node::leaf(degree_[n], static_cast<std::uint32_t>(start_[n]));
    basis::forEachCoefficient(degree_[n], [&](int i, int j, int k, int index) {
      const std::size_t at = start_[n] + index;
      coefficients[at] = x[at] / (scale_[leaves_[n].depth] * std::sqrt(basis::squaredNorm(i, j, k)));
    });
  }
  field.coefficients = std::move(coefficients);
}

/// Restricts a leaf's polynomial to one of the leaf's two faces perpendicular to the link's axis: the lower
/// face (`side` 0) or the upper one (1).
void FaceCoupling::restrictToFace(const Link& link, std::uint32_t leaf, int side, const double* x, double* face) const {
  x += start_[leaf];
  if (withKnownTrace(degree_[leaf], link.axis, [&](auto trace) { trace.apply(kEndValues[side].data(), x, face); }))
    return;
  std::fill_n(face, faceCoefficientCount(degree_[leaf]), 0.0);
  const Trace& trace = traces_[degree_[leaf]][link.axis];
  for (std::size_t c = 0; c < trace.faceIndex.size(); ++c) face[trace.faceIndex[c]] += trace.factor[side][c] * x[c];
}

/// Adds scale·Tᵀ·face to the leaf's part of `out`. The matrix T maps the coefficients of the leaf to the coefficients
/// on the face, see `restrictToFace`.
void FaceCoupling::addFromFace(const Link& link, std::uint32_t leaf, int side, double scale, const double* face,
                               double* out) const {
  out += start_[leaf];
  if (withKnownTrace(degree_[leaf], link.axis,
                     [&](auto trace) { trace.addTransposed(kEndValues[side].data(), scale, face, out); }))
    return;
  const Trace& trace = traces_[degree_[leaf]][link.axis];
  for (std::size_t c = 0; c < trace.faceIndex.size(); ++c)
    out[c] += scale * trace.factor[side][c] * face[trace.faceIndex[c]];
}

/// Computes the jump across the face of link n: the small leaf's polynomial minus the large leaf's polynomial, as
/// coefficients on the small leaf's face. The coefficients are scaled so that their squares sum to the face's part of
/// xᵀMx. The numbers in x contain the square root of their leaf's volume as a factor; `scale` replaces the large leaf's
/// volume by the small leaf's volume. A fixed leaf counts as 0.
void FaceCoupling::computeJump(std::size_t n, const double* x) {
  const Link& link = links_[n];
  double* const jump = &jumps_[jumpStart_[n]];
  if (isFixed_[link.large]) return restrictToFace(link, link.small, link.side, x, jump);
  std::array<double, kMaxFaceCoefficients> large;
  restrictToFace(link, link.large, 1 - link.side, x, large.data());
  for (int level = link.levels; level-- > 0;)
    query::withDegree(degree_[link.large], [&](auto degree) {
      kQuarterRestriction.apply(large.data(), degree, quarterOf(link.along, level));
    });
  const std::size_t smallCount = isFixed_[link.small] ? 0 : faceCoefficientCount(degree_[link.small]);
  const std::size_t largeCount = faceCoefficientCount(degree_[link.large]);
  if (smallCount > 0) restrictToFace(link, link.small, link.side, x, jump);
  for (std::size_t c = smallCount; c < largeCount; ++c) jump[c] = 0;
  const double scale = scale_[link.levels] / scale_[0];
  for (std::size_t c = 0; c < largeCount; ++c) jump[c] -= scale * large[c];
}

/// Adds the leaf's part of Jᵀ(Jx) to `out`. The matrix J maps the vector x to the jump Jx across the face of link n,
/// see `computeJump`. The sum over all links is the product Mx.
void FaceCoupling::addJump(std::uint32_t leaf, std::size_t n, double* out) const {
  const Link& link = links_[n];
  const double* face = &jumps_[jumpStart_[n]];
  if (leaf == link.small) return addFromFace(link, leaf, link.side, 1, face, out);
  std::array<double, kMaxFaceCoefficients> whole;
  if (link.levels > 0) {
    for (std::size_t a = 0; a < faceCoefficientCount(degree_[leaf]); ++a) whole[a] = face[a];
    for (int level = 0; level < link.levels; ++level)
      query::withDegree(degree_[leaf], [&](auto degree) {
        kQuarterRestriction.applyTransposed(whole.data(), degree, quarterOf(link.along, level));
      });
    face = whole.data();
  }
  addFromFace(link, leaf, 1 - link.side, -scale_[link.levels] / scale_[0], face, out);
}

/// Computes the part of the jump across the face of link n that comes from a fixed leaf, in the same form as
/// `computeJump`: the trace of the fixed leaf with the sign that it has in the jump, projected onto the polynomials of
/// the face's degree. The rest of the trace is orthogonal to the trace of the other leaf's polynomial. It adds a
/// constant to the energy, which does not matter.
void FaceCoupling::computeFixedJump(const FieldData& field, std::size_t n, const FaceSamples& samples) {
  const Link& link = links_[n];
  double* const jump = &jumps_[jumpStart_[n]];
  const query::OctreeNode& small = leaves_[link.small];
  const query::OctreeNode& fixed = leaves_[isFixed_[link.small] ? link.small : link.large];
  const GridFrame frame = query::gridFrame(field);
  const auto coordinate = [&](int axis, double local) {
    return std::ldexp(static_cast<double>(small.cellIndex[axis]) + (local + 1) / 2, -small.depth);
  };
  const double scale = (isFixed_[link.small] ? 1 : -1) * scale_[small.depth];
  const int axis0 = link.axis == 0 ? 1 : 0, axis1 = link.axis == 2 ? 1 : 2;
  std::array<double, 3> at;
  at[link.axis] = coordinate(link.axis, link.side == 0 ? -1 : 1);
  std::fill_n(jump, jumpStart_[n + 1] - jumpStart_[n], 0.0);
  for (std::size_t s0 = 0; s0 < samples.points.size(); ++s0)
    for (std::size_t s1 = 0; s1 < samples.points.size(); ++s1) {
      at[axis0] = coordinate(axis0, samples.points[s0]);
      at[axis1] = coordinate(axis1, samples.points[s1]);
      const query::LeafPoint point =
          query::leafPoint(field.nodes[fixed.node], fixed.depth, fixed.node, fixed.cellIndex, at);
      samples.project(s0, s1, scale * query::evaluateLeaf<double>(field, frame, at, point), jump);
    }
}

/// Sets `fixedPart_`. For x = 0, the jumps consist of their parts from fixed leaves, and half of the gradient of their
/// energy is Jᵀ times these parts.
void FaceCoupling::findFixedPart(const FieldData& field) {
  const auto hasFixed = [&](const Link& link) { return isFixed_[link.small] || isFixed_[link.large]; };
  if (std::ranges::none_of(links_, hasFixed)) return;
  std::vector<std::optional<FaceSamples>> samples(kMaxDegree + 1);
  for (const Link& link : links_)
    if (auto& made = samples[faceDegree(link)]; hasFixed(link) && !made) made.emplace(faceDegree(link));
  std::ranges::fill(jumps_, 0.0);
  detail::forEachChunk(links_.size(), kLeavesPerTask, [&](std::size_t, std::size_t first, std::size_t count) {
    for (std::size_t n = first; n < first + count; ++n)
      if (hasFixed(links_[n])) computeFixedJump(field, n, *samples[faceDegree(links_[n])]);
  });
  fixedPart_.assign(start_.back(), 0.0);
  detail::forEachChunk(leaves_.size(), kLeavesPerTask,
                       [&](std::size_t, std::size_t first, std::size_t count) { addJumps(first, count, fixedPart_); });
}

/// Adds the parts of some leaves in Jᵀ(Jx) to `out`, for all links of these leaves.
void FaceCoupling::addJumps(std::size_t firstLeaf, std::size_t count, std::vector<double>& out) const {
  for (std::size_t leaf = firstLeaf; leaf < firstLeaf + count; ++leaf) {
    if (isFixed_[leaf]) continue;
    for (std::size_t n = linksOfLeafStart_[leaf]; n < linksOfLeafStart_[leaf + 1]; ++n)
      addJump(static_cast<std::uint32_t>(leaf), linksOfLeaf_[n], out.data());
  }
}

double FaceCoupling::apply(double weight, const std::vector<double>& x, std::vector<double>& out) {
  detail::forEachChunk(links_.size(), kLeavesPerTask, [&](std::size_t, std::size_t first, std::size_t count) {
    for (std::size_t n = first; n < first + count; ++n) computeJump(n, x.data());
  });
  std::vector<double> sums(detail::chunksOf(leaves_.size(), kLeavesPerTask));
  detail::forEachChunk(leaves_.size(), kLeavesPerTask, [&](std::size_t chunk, std::size_t first, std::size_t count) {
    const std::size_t last = first + count;
    for (std::size_t c = start_[first]; c < start_[last]; ++c) out[c] = weight * x[c];
    addJumps(first, count, out);
    for (std::size_t c = start_[first]; c < start_[last]; ++c) sums[chunk] += x[c] * out[c];
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

std::vector<double> FaceCoupling::diagonal() const {
  std::vector<double> result(start_.back(), 0.0);
  for (const Link& link : links_)
    for (const std::uint32_t leaf : {link.small, link.large}) {
      if (isFixed_[leaf]) continue;
      const double share = leaf == link.small ? 1 : std::ldexp(1.0, -3 * link.levels);
      const auto& factor = traces_[degree_[leaf]][link.axis].factor[0];
      for (std::size_t c = 0; c < factor.size(); ++c) result[start_[leaf] + c] += share * factor[c] * factor[c];
    }
  return result;
}

}  // namespace hpsdf::continuity
