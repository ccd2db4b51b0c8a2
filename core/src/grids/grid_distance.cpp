#include "hpsdf/input/grid_distance.h"

#include <algorithm>
#include <bit>
#include <bitset>
#include <cmath>
#include <limits>
#include <string>
#include <unordered_map>
#include <utility>

#include "grids/grid_memory.h"
#include "hpsdf/triangle_mesh.h"
#include "util/chunks.h"
#include "util/refuse.h"

namespace hpsdf {
namespace {

constexpr int kBlock = SampledBlocks::kSize;
constexpr double kNearSpacings = 3;  ///< samples at most so many spacings from the surface are near it
constexpr double kNoSample = std::numeric_limits<double>::quiet_NaN();

using SampleIndex = std::array<std::int32_t, 3>;

/// The weights of four samples along an axis, and their derivatives with respect to the index.
struct CubicWeights {
  std::int32_t first = 0;  ///< index of the first of the samples
  std::array<double, 4> value{}, slope{};
};

/// Returns the weights of Catmull-Rom splines at the fraction t between the second and the third sample.
CubicWeights cubicWeights(std::int32_t first, double t) {
  const double t2 = t * t, t3 = t2 * t;
  return {first,
          {0.5 * (-t + 2 * t2 - t3), 0.5 * (2 - 5 * t2 + 3 * t3), 0.5 * (t + 4 * t2 - 3 * t3), 0.5 * (t3 - t2)},
          {0.5 * (-1 + 4 * t - 3 * t2), 0.5 * (-10 * t + 9 * t2), 0.5 * (1 + 8 * t - 9 * t2), 0.5 * (3 * t2 - 2 * t)}};
}

/// Replaces the first or the last of four weights, whose sample does not exist, by weights of the other samples and the
/// next one: the missing sample is 3a − 3b + c with its nearest neighbours a, b, c, which is right for quadratic
/// polynomials.
void shiftWeights(std::array<double, 4>& weights, bool isFirstMissing) {
  if (!isFirstMissing) std::ranges::reverse(weights);
  const double missing = weights[0];
  weights = {weights[1] + 3 * missing, weights[2] - 3 * missing, weights[3] + missing, 0};
  if (!isFirstMissing) std::ranges::reverse(weights);
}

}  // namespace

/// Samples in blocks, found by a table of the blocks in the box that contains all of them.
struct GridDistance::Samples {
  Samples(const Vector3& itsOrigin, const Vector3& itsSpacing) : origin(itsOrigin), spacing(itsSpacing) {}

  Vector3 origin, spacing;
  std::vector<SampledBlocks::Block> blocks;
  std::optional<SampleIndex> points;  ///< numbers of points of a grid that fills a box

  /// Takes the blocks. Throws `Error` for an index that `keyOf` cannot hold.
  void fill(std::vector<SampledBlocks::Block> some) {
    constexpr std::int32_t kMostBlocks = grids::kMostPointsOfAxis / kBlock;
    const auto isBeyond = [](std::int32_t index) { return index < -kMostBlocks || index >= kMostBlocks; };
    for (const SampledBlocks::Block& block : some)
      if (std::ranges::any_of(block.index, isBeyond))
        detail::refuse("the grid has samples with indices beyond ", grids::kMostPointsOfAxis,
                       "; move it nearer to the origin, or take one with larger voxels");
    blocks = std::move(some);
    for (std::size_t n = 0; n < blocks.size(); ++n) places_.emplace(keyOf(blocks[n].index), n);
  }

  const SampledBlocks::Block* blockAt(const SampleIndex& block) const {
    const auto found = places_.find(keyOf(block));
    return found == places_.end() ? nullptr : &blocks[found->second];
  }

  static std::size_t numberInBlock(const SampleIndex& at) {
    return std::size_t(((at[2] & (kBlock - 1)) * kBlock + (at[1] & (kBlock - 1))) * kBlock + (at[0] & (kBlock - 1)));
  }
  static SampleIndex blockOf(const SampleIndex& at) { return {at[0] >> 3, at[1] >> 3, at[2] >> 3}; }

  /// Returns a sample, or NaN if there is none.
  double at(const SampleIndex& index) const {
    const SampledBlocks::Block* const block = blockAt(blockOf(index));
    return block == nullptr ? kNoSample : block->values[numberInBlock(index)];
  }

  /// Finds the samples that have all samples within two steps around them, so that each cell beside them has all
  /// samples of its interpolation.
  void findSurrounded() {
    surrounded_.resize(blocks.size());
    detail::forEachChunk(blocks.size(), 1, [&](std::size_t n, std::size_t, std::size_t) {
      surrounded_[n] = surroundedIn(blocks[n].index);
    });
  }

  /// Returns how much the interpolation counts at x, in units of samples, against the other distance: 1 in cells whose
  /// corners are surrounded by samples, 0 where a sample of the interpolation is missing, and trilinear in between, so
  /// that the distance does not jump. `gradient` is with respect to the index.
  double shareAt(const Vector3& x, Vector3& gradient) const {
    gradient.setZero();
    if (points) return 1;
    const Vector3 low = x.array().floor(), t = x - low;
    const SampleIndex first = {std::int32_t(low[0]), std::int32_t(low[1]), std::int32_t(low[2])};
    double share = 0;
    int corners = 0;
    for (int n = 0; n < 8; ++n) {
      const std::array<int, 3> upper = {n & 1, n >> 1 & 1, n >> 2};
      if (!isSurrounded({first[0] + upper[0], first[1] + upper[1], first[2] + upper[2]})) continue;
      ++corners;
      std::array<double, 3> weight;
      for (int axis = 0; axis < 3; ++axis) weight[axis] = upper[axis] == 1 ? t[axis] : 1 - t[axis];
      share += weight[0] * weight[1] * weight[2];
      for (int axis = 0; axis < 3; ++axis)
        gradient[axis] += (upper[axis] == 1 ? 1 : -1) * weight[(axis + 1) % 3] * weight[(axis + 2) % 3];
    }
    if (corners < 8) return share;
    gradient.setZero();
    return 1;
  }

  /// Copies the 4³ samples from `first` on. Returns false if one of them is missing.
  bool copyStencil(const SampleIndex& first, std::array<double, 64>& out) const {
    // The stencil meets up to two blocks along each axis.
    const SampleIndex lower = blockOf(first);
    std::array<const SampledBlocks::Block*, 8> met{};
    std::array<bool, 8> isKnown{};
    double sum = 0;
    for (int n = 0; n < 64; ++n) {
      const SampleIndex index = {first[0] + (n & 3), first[1] + (n >> 2 & 3), first[2] + (n >> 4)};
      const SampleIndex block = blockOf(index);
      const auto slot = std::size_t((block[0] - lower[0]) + 2 * (block[1] - lower[1]) + 4 * (block[2] - lower[2]));
      if (!std::exchange(isKnown[slot], true)) met[slot] = blockAt(block);
      if (met[slot] == nullptr) return false;
      sum += out[n] = met[slot]->values[numberInBlock(index)];
    }
    return !std::isnan(sum);
  }

  /// Returns the weights along an axis at a coordinate in units of samples.
  CubicWeights weightsAt(int axis, double x) const {
    const double cell = std::floor(x);
    if (!points) return cubicWeights(std::int32_t(cell) - 1, x - cell);
    const std::int32_t last = (*points)[axis] - 2;  // index of the last cell
    const std::int32_t inside = std::clamp(std::int32_t(cell), 0, last);
    CubicWeights weights = cubicWeights(inside - 1, x - inside);
    if (inside > 0 && inside < last) return weights;
    shiftWeights(weights.value, inside == 0);
    shiftWeights(weights.slope, inside == 0);
    weights.first += inside == 0 ? 1 : -1;
    return weights;
  }

  /// Interpolates at x, in units of samples, or returns false. The gradient is with respect to the index.
  template <bool WithGradient>
  bool interpolate(const Vector3& x, double& value, Vector3& gradient) const {
    const std::array<CubicWeights, 3> weights = {weightsAt(0, x[0]), weightsAt(1, x[1]), weightsAt(2, x[2])};
    std::array<double, 64> samples;
    if (!copyStencil({weights[0].first, weights[1].first, weights[2].first}, samples)) return false;
    value = 0;
    gradient.setZero();
    for (int k = 0; k < 4; ++k)
      for (int j = 0; j < 4; ++j) {
        const double* const row = &samples[16 * k + 4 * j];
        double alongX = 0, slopeX = 0;
        for (int i = 0; i < 4; ++i) {
          alongX += weights[0].value[i] * row[i];
          if constexpr (WithGradient) slopeX += weights[0].slope[i] * row[i];
        }
        value += weights[2].value[k] * weights[1].value[j] * alongX;
        if constexpr (WithGradient)
          gradient += Vector3(weights[2].value[k] * weights[1].value[j] * slopeX,
                              weights[2].value[k] * weights[1].slope[j] * alongX,
                              weights[2].slope[k] * weights[1].value[j] * alongX);
      }
    return true;
  }

  /// Evaluates the distance and, if it is asked for, its gradient at a point in world units. Returns how much it counts
  /// against the other distance, with the gradient of this share.
  template <bool WithGradient>
  double evaluate(const Vector3& point, double& value, Vector3& gradient, Vector3& shareGradient) const {
    const Vector3 wanted = (point - origin).cwiseQuotient(spacing), x = clamped(wanted);
    if (!x.allFinite() || !(x.cwiseAbs().maxCoeff() < double(grids::kMostPointsOfAxis))) return 0;
    const double share = shareAt(x, shareGradient);
    if (share == 0 || !interpolate<WithGradient>(x, value, gradient)) return 0;
    shareGradient = shareGradient.cwiseQuotient(spacing);
    gradient = gradient.cwiseQuotient(spacing);
    continueBeyond((wanted - x).cwiseProduct(spacing), value, gradient);
    return share;
  }

 private:
  /// Returns the closest point of the box of a grid that fills one, in units of samples.
  Vector3 clamped(Vector3 x) const {
    if (points)
      for (int axis = 0; axis < 3; ++axis) x[axis] = std::clamp(x[axis], 0.0, double((*points)[axis] - 1));
    return x;
  }

  /// Continues a distance from the closest point of the box to a point at `offset` from it.
  static void continueBeyond(const Vector3& offset, double& value, Vector3& gradient) {
    if (offset.isZero(0)) return;
    value += offset.norm();
    for (int axis = 0; axis < 3; ++axis)
      if (offset[axis] != 0) gradient[axis] = 0;
    gradient += offset.normalized();
  }

  /// Packs the index of a block, of which 21 bits along each axis suffice for 24-bit indices of samples.
  static std::uint64_t keyOf(const SampleIndex& block) {
    std::uint64_t key = 0;
    for (const std::int32_t i : block) key = key << 21 | (std::uint64_t(i) & 0x1fffff);
    return key;
  }

  using Flags = std::bitset<std::size_t{kBlock} * kBlock * kBlock>;

  bool isSurrounded(const SampleIndex& index) const {
    const auto found = places_.find(keyOf(blockOf(index)));
    return found != places_.end() && surrounded_[found->second][numberInBlock(index)];
  }

  /// Returns which samples of a block have all samples within two steps around them. Erodes the samples that exist
  /// along one axis after the other.
  Flags surroundedIn(const SampleIndex& block) const {
    constexpr int kReach = 2, kEdge = kBlock + 2 * kReach;
    const auto number = [](int x, int y, int z) { return std::size_t((z * kEdge + y) * kEdge + x); };
    std::array<char, std::size_t{kEdge} * kEdge * kEdge> exists;
    for (int z = 0; z < kEdge; ++z)
      for (int y = 0; y < kEdge; ++y)
        for (int x = 0; x < kEdge; ++x)
          exists[number(x, y, z)] = !std::isnan(
              at({kBlock * block[0] + x - kReach, kBlock * block[1] + y - kReach, kBlock * block[2] + z - kReach}));
    for (const std::size_t step : {number(1, 0, 0), number(0, 1, 0), number(0, 0, 1)}) {
      const auto before = exists;
      for (std::size_t n = kReach * step; n + kReach * step < exists.size(); ++n)
        exists[n] = before[n - 2 * step] && before[n - step] && before[n] && before[n + step] && before[n + 2 * step];
    }
    Flags surrounded;
    for (int z = 0; z < kBlock; ++z)
      for (int y = 0; y < kBlock; ++y)
        for (int x = 0; x < kBlock; ++x)
          surrounded[numberInBlock({x, y, z})] = exists[number(x + kReach, y + kReach, z + kReach)] != 0;
    return surrounded;
  }

  std::unordered_map<std::uint64_t, std::size_t> places_;
  std::vector<Flags> surrounded_;  ///< for each block; empty for a grid that fills a box
};

namespace {

/// Cuts a grid's values into blocks.
std::vector<SampledBlocks::Block> blocksOf(const RegularGrid& grid) {
  const auto& points = grid.layout.points;
  SampleIndex counts;
  for (int axis = 0; axis < 3; ++axis) counts[axis] = std::int32_t((points[axis] + kBlock - 1) / kBlock);
  std::vector<SampledBlocks::Block> blocks(std::size_t{1} * counts[0] * counts[1] * counts[2]);
  detail::forEachChunk(blocks.size(), 1, [&](std::size_t n, std::size_t, std::size_t) {
    SampledBlocks::Block& block = blocks[n];
    const auto number = std::int32_t(n);
    block.index = {number % counts[0], number / counts[0] % counts[1], number / counts[0] / counts[1]};
    block.values.fill(kNoSample);
    const auto end = [&](int axis) { return std::min(std::int32_t(points[axis]), kBlock * (block.index[axis] + 1)); };
    for (std::int32_t z = kBlock * block.index[2]; z < end(2); ++z)
      for (std::int32_t y = kBlock * block.index[1]; y < end(1); ++y)
        for (std::int32_t x = kBlock * block.index[0]; x < end(0); ++x)
          block.values[GridDistance::Samples::numberInBlock({x, y, z})] =
              grid.values[x + points[0] * (y + std::size_t{points[1]} * z)];
  });
  return blocks;
}

void requireUsableGrid(const RegularGrid& grid) {
  const auto& points = grid.layout.points;
  const double x = points[0], y = points[1], z = points[2];
  grids::requireReadableGrid(x, y, z, sizeof(double));
  if (*std::ranges::min_element(points) < 4)
    detail::refuse("a grid of ", points[0], " x ", points[1], " x ", points[2],
                   " points; the interpolation needs four points or more along each axis");
  const auto isBad = [](double value) { return !(std::abs(value) <= kLargestCoordinate); };
  if (const auto bad = std::ranges::find_if(grid.values, isBad); bad != grid.values.end())
    detail::refuse("the value number ", bad - grid.values.begin() + 1,
                   " of the grid is not a finite number up to 1e100");
  if (!(grid.layout.spacing.minCoeff() > 0) || !grid.layout.spacing.allFinite() || !grid.layout.origin.allFinite())
    detail::refuse("the spacing of the grid is not a positive length, or its origin is not finite");
  constexpr double kLeastShare = 0x1p-40;  // of the coordinates; less is a few thousand times their rounding
  const Vector3 farthest = grid.layout.box().min().cwiseAbs().cwiseMax(grid.layout.box().max().cwiseAbs());
  if (!(farthest.maxCoeff() <= kLargestCoordinate) || (grid.layout.spacing - kLeastShare * farthest).minCoeff() < 0)
    detail::refuse("the grid is so far from the origin, at ", farthest.maxCoeff(),
                   ", that rounding spoils its spacing of ", grid.layout.spacing.minCoeff());
  // The last blocks along each axis are filled up with points that do not exist.
  const auto blocks = [](double count) { return std::ceil(count / kBlock); };
  grids::requireGridMemory(x, y, z, sizeof(SampledBlocks::Block) * blocks(x) * blocks(y) * blocks(z) / (x * y * z),
                           grids::kCoarserGrid);
  if (grid.values.size() != grid.layout.count())
    detail::refuse("a grid of ", grid.layout.count(), " points with ", grid.values.size(), " values");
}

/// Calls visit(index, value) for all samples.
template <typename Visit>
void visitSamples(const std::vector<SampledBlocks::Block>& blocks, const Visit& visit) {
  for (const SampledBlocks::Block& block : blocks)
    for (int n = 0; n < kBlock * kBlock * kBlock; ++n)
      if (const double value = block.values[n]; !std::isnan(value))
        visit(SampleIndex{block.index[0] * kBlock + n % kBlock, block.index[1] * kBlock + n / kBlock % kBlock,
                          block.index[2] * kBlock + n / kBlock / kBlock},
              value);
}

/// Returns the box of the points where the distance changes its sign between neighbouring samples, in world units. It
/// is empty if there are none.
Box surfaceBoxOf(const GridDistance::Samples& samples) {
  Box box;
  visitSamples(samples.blocks, [&](const SampleIndex& index, double value) {
    for (int axis = 0; axis < 3; ++axis) {
      SampleIndex next = index;
      ++next[axis];
      const double other = samples.at(next);
      if (std::isnan(other) || (value < 0) == (other < 0)) continue;
      Vector3 crossing(index[0], index[1], index[2]);
      crossing[axis] += value / (value - other);
      box.extend(samples.origin + crossing.cwiseProduct(samples.spacing));
    }
  });
  return box;
}

/// Returns a hash of the samples' values and places.
std::uint64_t fingerprintOf(const GridDistance::Samples& samples) {
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a over 64-bit numbers
  const auto add = [&](std::uint64_t bits) {
    hash = (hash ^ bits) * 0x100000001b3;
    hash ^= hash >> 32;
  };
  for (int axis = 0; axis < 3; ++axis) {
    add(std::bit_cast<std::uint64_t>(samples.origin[axis]));
    add(std::bit_cast<std::uint64_t>(samples.spacing[axis]));
  }
  visitSamples(samples.blocks, [&](const SampleIndex& index, double value) {
    for (const auto number : index) add(static_cast<std::uint64_t>(number));
    add(std::bit_cast<std::uint64_t>(value));
  });
  return hash;
}

/// Completes the source of a distance from samples. Throws `Error` if the samples have no surface between them.
Source sourceOf(const GridDistance::Samples& samples, Source source) {
  source.box = surfaceBoxOf(samples);
  if (source.box.isEmpty())
    throw Error(ErrorKind::file, "", "the grid has no surface: all of its values have the same sign");
  source.fingerprint = fingerprintOf(samples);
  return source;
}

/// A point at which the interpolation counts by a share below 1.
struct SharedPoint {
  std::size_t number;
  double share;
  Vector3 shareGradient;
};

/// Asks the other distance for all points at which the interpolation does not count alone, and adds its share. Without
/// another distance, they get NaN.
template <bool WithGradients>
void addBeyond(const std::optional<DistanceFunction>& beyond, std::span<const Vector3> points,
               std::span<const SharedPoint> missing, std::span<double> out, std::span<Vector3> gradients) {
  std::vector<Vector3> others(missing.size()), otherGradients(missing.size(), Vector3::Constant(kNoSample));
  std::vector<double> values(missing.size(), kNoSample);
  for (std::size_t n = 0; n < missing.size(); ++n) others[n] = points[missing[n].number];
  if (beyond && WithGradients) beyond->withGradients(others, values, otherGradients);
  if (beyond && !WithGradients) (*beyond)(others, values);
  for (std::size_t n = 0; n < missing.size(); ++n) {
    const auto& [number, share, shareGradient] = missing[n];
    if constexpr (WithGradients)
      gradients[number] = share == 0 ? otherGradients[n]
                                     : Vector3(share * gradients[number] + (1 - share) * otherGradients[n] +
                                               (out[number] - values[n]) * shareGradient);
    out[number] = share == 0 ? values[n] : share * out[number] + (1 - share) * values[n];
  }
}

}  // namespace

GridDistance::GridDistance(const RegularGrid& grid, Source source) {
  requireUsableGrid(grid);
  auto samples = std::make_shared<Samples>(grid.layout.origin, grid.layout.spacing);
  samples->points.emplace();
  for (int axis = 0; axis < 3; ++axis) (*samples->points)[axis] = std::int32_t(grid.layout.points[axis]);
  samples->fill(blocksOf(grid));
  source_ = sourceOf(*samples, std::move(source));
  samples_ = std::move(samples);
}

GridDistance::GridDistance(SampledBlocks samples, DistanceFunction beyond, Source source) : beyond_(std::move(beyond)) {
  auto own = std::make_shared<Samples>(samples.origin, samples.spacing);
  own->fill(std::move(samples.blocks));
  own->findSurrounded();
  source_ = sourceOf(*own, std::move(source));
  samples_ = std::move(own);
}

template <bool WithGradients>
void GridDistance::evaluate(std::span<const Vector3> points, std::span<double> out,
                            std::span<Vector3> gradients) const {
  std::vector<SharedPoint> missing;
  Vector3 gradient = Vector3::Zero(), shareGradient = Vector3::Zero();
  for (std::size_t n = 0; n < points.size(); ++n) {
    const double share = samples_->evaluate<WithGradients>(points[n], out[n], gradient, shareGradient);
    if (share < 1) missing.push_back({n, share, shareGradient});
    if constexpr (WithGradients) gradients[n] = gradient;
  }
  if (!missing.empty()) addBeyond<WithGradients>(beyond_, points, missing, out, gradients);
}

void GridDistance::operator()(std::span<const Vector3> points, std::span<double> out) const {
  evaluate<false>(points, out, {});
}

bool GridDistance::hasGradients() const { return !beyond_ || beyond_->hasGradients(); }

void GridDistance::withGradients(std::span<const Vector3> points, std::span<double> out,
                                 std::span<Vector3> gradients) const {
  evaluate<true>(points, out, gradients);
}

const Source& GridDistance::source() const { return source_; }

std::size_t GridDistance::bytes() const {
  return samples_->blocks.size() * sizeof(SampledBlocks::Block) + (beyond_ ? beyond_->bytes() : 0);
}

Box GridDistance::domain() const {
  if (!samples_->points) return {};
  const auto& [x, y, z] = *samples_->points;
  return Box(samples_->origin, samples_->origin + Vector3(x - 1, y - 1, z - 1).cwiseProduct(samples_->spacing));
}

InterpolationError GridDistance::interpolationError() const {
  const double near = kNearSpacings * samples_->spacing.maxCoeff();
  detail::Sums sums;
  visitSamples(samples_->blocks, [&](const SampleIndex& index, double value) {
    if (std::abs(value) > near) return;
    double greatest = kNoSample;
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = [&](int steps) {
        SampleIndex other = index;
        other[axis] += steps;
        return samples_->at(other);
      };
      const double difference = std::abs((9 * (at(-1) + at(1)) - at(-3) - at(3)) / 16 - value);
      greatest = std::fmax(greatest, difference);
    }
    if (!std::isnan(greatest)) sums.add(greatest / 2);
  });
  return {sums.count, sums.rms(), sums.max};
}

}  // namespace hpsdf
