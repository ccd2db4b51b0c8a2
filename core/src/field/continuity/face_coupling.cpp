#include "field/continuity/face_coupling.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <variant>

#include "basis/half_shares.h"
#include "basis/projection.h"
#include "field/query/evaluate.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

constexpr std::size_t kChunk = 256;
constexpr std::size_t kMostOnFace = (kMaxDegree + 1) * (kMaxDegree + 2) / 2;

constexpr std::size_t chunks(std::size_t count) { return (count + kChunk - 1) / kChunk; }

/// Coefficients of a polynomial of total degree p on a face, and the place of the product of degrees a and b.
constexpr std::size_t countOnFace(int degree) { return std::size_t(degree + 1) * (degree + 2) / 2; }
constexpr std::size_t placeOnFace(int a, int b) { return std::size_t(a + b) * (a + b + 1) / 2 + b; }

/// What orthonormal polynomial a of the half of an axis has of polynomial i of the whole.
class Halving {
 public:
  Halving() {
    const HalfShares shares;
    for (int i = 0; i <= kMaxDegree; ++i)
      for (int a = 0; a <= i; ++a) {
        const double scale = 2 * std::sqrt((2 * a + 1.0) / (2 * i + 1));
        share_[0][i][a] = scale * shares.below(i, a);
        share_[1][i][a] = scale * shares.above(i, a);
      }
  }

  /// A face's polynomial onto a quarter of it; bits of `quarter`: upper half of the first, of the second axis.
  template <typename Degree>
  void restrict(double* face, Degree degree, int quarter) const {
    for (int along = 0; along < 2; ++along) {
      const auto& share = share_[quarter >> along & 1];
      for (int b = 0; b <= degree; ++b)
        for (int a = 0; a <= degree - b; ++a) {  // upwards: the higher ones are still those of the whole
          double sum = 0;
          for (int i = a; i <= degree - b; ++i) sum += share[i][a] * at(face, along, i, b);
          at(face, along, a, b) = sum;
        }
    }
  }

  template <typename Degree>
  void transposed(double* face, Degree degree, int quarter) const {
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
    return face[along == 0 ? placeOnFace(a, b) : placeOnFace(b, a)];
  }

  std::array<std::array<std::array<double, kMaxDegree + 1>, kMaxDegree + 1>, 2> share_{};
};

const Halving halving;

/// Where coefficients of a degree that is known when compiling go on a face across an axis.
template <int P, int Axis>
struct KnownTrace {
  static constexpr int kCount = coefficientCount(P);
  struct Entry {
    std::uint8_t place;
    std::uint8_t order;  ///< along the axis
  };
  static constexpr std::array<Entry, kCount> kEntries = [] {
    std::array<Entry, kCount> entries{};
    int index = 0;
    for (int i = 0; i <= P; ++i)
      for (int j = 0; j <= P - i; ++j)
        for (int k = 0; k <= P - i - j; ++k)
          entries[index++] =
              Axis == 0   ? Entry{static_cast<std::uint8_t>(placeOnFace(j, k)), static_cast<std::uint8_t>(i)}
              : Axis == 1 ? Entry{static_cast<std::uint8_t>(placeOnFace(i, k)), static_cast<std::uint8_t>(j)}
                          : Entry{static_cast<std::uint8_t>(placeOnFace(i, j)), static_cast<std::uint8_t>(k)};
    return entries;
  }();

  /// `ends`: the orthonormal polynomials at the end where the face lies.
  static void take(const double* ends, const double* x, double* face) {
    std::array<double, countOnFace(P)> sums{};
    [&]<std::size_t... C>(std::index_sequence<C...>) {
      ((sums[kEntries[C].place] += ends[kEntries[C].order] * x[C]), ...);
    }
    (std::make_index_sequence<kCount>());
    for (std::size_t a = 0; a < sums.size(); ++a) face[a] = sums[a];
  }

  static void give(const double* ends, double scale, const double* face, double* out) {
    std::array<double, countOnFace(P)> scaled;
    for (std::size_t a = 0; a < scaled.size(); ++a) scaled[a] = scale * face[a];
    [&]<std::size_t... C>(std::index_sequence<C...>) {
      ((out[C] += ends[kEntries[C].order] * scaled[kEntries[C].place]), ...);
    }
    (std::make_index_sequence<kCount>());
  }
};

/// The orthonormal polynomials at the lower and the upper end.
const auto ends = [] {
  std::array<std::array<double, kMaxDegree + 1>, 2> values{};
  for (int i = 0; i <= kMaxDegree; ++i) {
    values[1][i] = std::sqrt(2 * i + 1.0);
    values[0][i] = i % 2 == 0 ? values[1][i] : -values[1][i];
  }
  return values;
}();

template <int P>
void takeKnown(int axis, int side, const double* x, double* face) {
  if (axis == 0) KnownTrace<P, 0>::take(ends[side].data(), x, face);
  if (axis == 1) KnownTrace<P, 1>::take(ends[side].data(), x, face);
  if (axis == 2) KnownTrace<P, 2>::take(ends[side].data(), x, face);
}

template <int P>
void giveKnown(int axis, int side, double scale, const double* face, double* out) {
  if (axis == 0) KnownTrace<P, 0>::give(ends[side].data(), scale, face, out);
  if (axis == 1) KnownTrace<P, 1>::give(ends[side].data(), scale, face, out);
  if (axis == 2) KnownTrace<P, 2>::give(ends[side].data(), scale, face, out);
}

int quarterOf(const std::array<std::uint32_t, 2>& along, int level) {
  return static_cast<int>((along[0] >> level & 1) | (along[1] >> level & 1) << 1);
}

}  // namespace

FaceCoupling::FaceCoupling(const FieldData& field) : leaves_(leavesOf(field)) {
  start_.push_back(0);
  for (const Leaf& leaf : leaves_) {
    degree_.push_back(static_cast<std::uint8_t>(node::degree(field.nodes[leaf.node])));
    start_.push_back(start_.back() + coefficientCount(degree_.back()));
  }
  if (start_.back() > 0xffffffffu)
    throw Error("the field needs " + std::to_string(start_.back()) +
                " coefficients, more than 2^32; raise the target error");
  const double baseCells = double(field.grid[0]) * field.grid[1] * field.grid[2];
  for (int depth = 0; depth <= kMaxDepth; ++depth) scale_.push_back(std::sqrt(std::ldexp(1.0, -3 * depth) / baseCells));
  for (const std::uint8_t degree : degree_) {
    if (!traces_[degree][0].place.empty()) continue;
    forEachCoefficient(degree, [&](int i, int j, int k, int) {
      const std::array<int, 3> index{i, j, k};
      for (int axis = 0; axis < 3; ++axis) {
        Trace& trace = traces_[degree][axis];
        const double end = std::sqrt(2 * index[axis] + 1.0);
        trace.place.push_back(static_cast<std::uint16_t>(placeOnFace(index[axis == 0], index[axis == 2 ? 1 : 2])));
        trace.factor[0].push_back(index[axis] % 2 == 0 ? end : -end);
        trace.factor[1].push_back(end);
      }
    });
  }
  linkLeaves(field);
  collectAround();
}

void FaceCoupling::linkLeaves(const FieldData& field) {
  std::vector<std::uint32_t> leafOf(field.nodes.size());
  for (std::size_t n = 0; n < leaves_.size(); ++n) leafOf[leaves_[n].node] = static_cast<std::uint32_t>(n);
  std::vector<std::vector<Link>> found(chunks(leaves_.size()));
  tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t chunk) {
    for (std::size_t n = chunk * kChunk; n < std::min(leaves_.size(), (chunk + 1) * kChunk); ++n)
      for (int axis = 0; axis < 3; ++axis)
        for (const int step : {-1, 1}) {
          const Leaf& small = leaves_[n];
          const auto large = notSmallerBeside(field, small, axis, step);
          if (!large || (large->depth == small.depth && step < 0)) continue;
          Link link{.small = static_cast<std::uint32_t>(n),
                    .large = leafOf[large->node],
                    .along = {},
                    .axis = static_cast<std::uint8_t>(axis),
                    .levels = static_cast<std::uint8_t>(small.depth - large->depth),
                    .side = static_cast<std::uint8_t>(step > 0)};
          const std::array<int, 2> axes{axis == 0 ? 1 : 0, axis == 2 ? 1 : 2};
          for (int a = 0; a < 2; ++a)
            link.along[a] = static_cast<std::uint32_t>(small.place[axes[a]] - (large->place[axes[a]] << link.levels));
          found[chunk].push_back(link);
        }
  });
  differsAt_.push_back(0);
  for (auto& links : found) {
    for (const Link& link : links) {
      links_.push_back(link);
      differsAt_.push_back(differsAt_.back() + countOnFace(std::max(degree_[link.small], degree_[link.large])));
    }
    links = {};
  }
  differences_.resize(differsAt_.back());
}

void FaceCoupling::collectAround() {
  if (links_.size() > 0xffffffffu)
    throw Error("the field has more than 2^32 faces between its cells; raise the target error");
  aroundAt_.assign(leaves_.size() + 1, 0);
  for (const Link& link : links_) {
    ++aroundAt_[link.small + 1];
    ++aroundAt_[link.large + 1];
  }
  std::partial_sum(aroundAt_.begin(), aroundAt_.end(), aroundAt_.begin());
  around_.resize(2 * links_.size());
  std::vector<std::size_t> next(aroundAt_.begin(), aroundAt_.end() - 1);
  for (std::size_t n = 0; n < links_.size(); ++n) {
    around_[next[links_[n].small]++] = static_cast<std::uint32_t>(n);
    around_[next[links_[n].large]++] = static_cast<std::uint32_t>(n);
  }
}

std::vector<double> FaceCoupling::toUnknowns(const FieldData& field) const {
  const auto& coefficients = std::get<std::vector<double>>(field.coefficients);
  std::vector<double> x(start_.back());
  for (std::size_t n = 0; n < leaves_.size(); ++n) {
    const double* c = &coefficients[node::offset(field.nodes[leaves_[n].node])];
    forEachCoefficient(degree_[n], [&](int i, int j, int k, int index) {
      x[start_[n] + index] = c[index] * scale_[leaves_[n].depth] * std::sqrt(squaredNorm(i, j, k));
    });
  }
  return x;
}

void FaceCoupling::fromUnknowns(std::span<const double> x, FieldData& field) const {
  std::vector<double> coefficients(start_.back());
  for (std::size_t n = 0; n < leaves_.size(); ++n) {
    field.nodes[leaves_[n].node] = node::leaf(degree_[n], static_cast<std::uint32_t>(start_[n]));
    forEachCoefficient(degree_[n], [&](int i, int j, int k, int index) {
      const std::size_t at = start_[n] + index;
      coefficients[at] = x[at] / (scale_[leaves_[n].depth] * std::sqrt(squaredNorm(i, j, k)));
    });
  }
  field.coefficients = std::move(coefficients);
}

/// A leaf's polynomial on its face across a link's axis, at the lower (0) or upper (1) end.
void FaceCoupling::take(const Link& link, std::uint32_t leaf, int side, const double* x, double* face) const {
  x += start_[leaf];
  switch (degree_[leaf]) {
    case 2:
      return takeKnown<2>(link.axis, side, x, face);
    case 3:
      return takeKnown<3>(link.axis, side, x, face);
    case 4:
      return takeKnown<4>(link.axis, side, x, face);
    case 5:
      return takeKnown<5>(link.axis, side, x, face);
  }
  std::fill_n(face, countOnFace(degree_[leaf]), 0.0);
  const Trace& trace = traces_[degree_[leaf]][link.axis];
  for (std::size_t c = 0; c < trace.place.size(); ++c) face[trace.place[c]] += trace.factor[side][c] * x[c];
}

/// The other way: adds what acts on the face to the leaf.
void FaceCoupling::give(const Link& link, std::uint32_t leaf, int side, double scale, const double* face,
                        double* out) const {
  out += start_[leaf];
  switch (degree_[leaf]) {
    case 2:
      return giveKnown<2>(link.axis, side, scale, face, out);
    case 3:
      return giveKnown<3>(link.axis, side, scale, face, out);
    case 4:
      return giveKnown<4>(link.axis, side, scale, face, out);
    case 5:
      return giveKnown<5>(link.axis, side, scale, face, out);
  }
  const Trace& trace = traces_[degree_[leaf]][link.axis];
  for (std::size_t c = 0; c < trace.place.size(); ++c) out[c] += scale * trace.factor[side][c] * face[trace.place[c]];
}

/// The jump across a link, times √(w_F·area/|Ω|), by the small face's polynomials: the small leaf's trace less the
/// large one's, whose unknowns carry a greater volume's root.
void FaceCoupling::differ(std::size_t n, const double* x) {
  const Link& link = links_[n];
  std::array<double, kMostOnFace> large;
  take(link, link.large, 1 - link.side, x, large.data());
  for (int level = link.levels; level-- > 0;)
    withDegree(degree_[link.large],
               [&](auto degree) { halving.restrict(large.data(), degree, quarterOf(link.along, level)); });
  double* const difference = &differences_[differsAt_[n]];
  const std::size_t ofSmall = countOnFace(degree_[link.small]), ofLarge = countOnFace(degree_[link.large]);
  take(link, link.small, link.side, x, difference);
  for (std::size_t c = ofSmall; c < ofLarge; ++c) difference[c] = 0;
  const double scale = scale_[link.levels] / scale_[0];
  for (std::size_t c = 0; c < ofLarge; ++c) difference[c] -= scale * large[c];
}

/// Adds what a link does to one of its leaves.
void FaceCoupling::pull(std::uint32_t leaf, std::size_t n, double* out) const {
  const Link& link = links_[n];
  const double* face = &differences_[differsAt_[n]];
  if (leaf == link.small) return give(link, leaf, link.side, 1, face, out);
  std::array<double, kMostOnFace> whole;
  if (link.levels > 0) {
    for (std::size_t a = 0; a < countOnFace(degree_[leaf]); ++a) whole[a] = face[a];
    for (int level = 0; level < link.levels; ++level)
      withDegree(degree_[leaf],
                 [&](auto degree) { halving.transposed(whole.data(), degree, quarterOf(link.along, level)); });
    face = whole.data();
  }
  give(link, leaf, 1 - link.side, -scale_[link.levels] / scale_[0], face, out);
}

double FaceCoupling::apply(double weight, const std::vector<double>& x, std::vector<double>& out) {
  tbb::parallel_for(std::size_t{0}, chunks(links_.size()), [&](std::size_t chunk) {
    for (std::size_t n = chunk * kChunk; n < std::min(links_.size(), (chunk + 1) * kChunk); ++n) differ(n, x.data());
  });
  std::vector<double> sums(chunks(leaves_.size()));
  tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t chunk) {
    const std::size_t first = chunk * kChunk, last = std::min(leaves_.size(), first + kChunk);
    for (std::size_t c = start_[first]; c < start_[last]; ++c) out[c] = weight * x[c];
    for (std::size_t leaf = first; leaf < last; ++leaf)
      for (std::size_t n = aroundAt_[leaf]; n < aroundAt_[leaf + 1]; ++n)
        pull(static_cast<std::uint32_t>(leaf), around_[n], out.data());
    for (std::size_t c = start_[first]; c < start_[last]; ++c) sums[chunk] += x[c] * out[c];
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

std::vector<double> FaceCoupling::diagonal() const {
  std::vector<double> result(start_.back(), 0.0);
  for (const Link& link : links_)
    for (const std::uint32_t leaf : {link.small, link.large}) {
      const double share = leaf == link.small ? 1 : std::ldexp(1.0, -3 * link.levels);
      const auto& factor = traces_[degree_[leaf]][link.axis].factor[0];
      for (std::size_t c = 0; c < factor.size(); ++c) result[start_[leaf] + c] += share * factor[c] * factor[c];
    }
  return result;
}

}  // namespace hpsdf
