#include "field/build/limits.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/triangle_search.h"
#include "util/refuse.h"

namespace hpsdf::detail {
namespace {

double allowedMemory(const BuildOptions& options) {
  const double most = hpsdf::allowedMemory();
  return options.memoryLimit ? std::min(most, double(*options.memoryLimit)) : most;
}

double baseCells(const BuildOptions& options) { return double(options.grid[0]) * options.grid[1] * options.grid[2]; }

/// Throws a `MemoryLimitError` whose message is made of the parts. `enough` are the bytes that are likely to suffice;
/// the limit that is suggested is some more, with two significant digits, as far as the machine allows it.
template <typename... Parts>
[[noreturn]] void refuseMemory(double enough, const Parts&... parts) {
  constexpr double kSpare = 1.2;
  const double unit = std::pow(10, std::floor(std::log10(kSpare * enough)) - 1);
  const double most = hpsdf::allowedMemory(), limit = std::min(std::ceil(kSpare * enough / unit) * unit, most);
  throw MemoryLimitError(messageOf(parts...), enough <= most ? std::uint64_t(limit) : 0);
}

/// Returns a number of cells as rounded text for messages.
std::string cellsText(double cells) {
  constexpr double kFew = 1e4;
  std::ostringstream text;
  text.precision(cells < kFew ? 0 : 2);
  text << std::fixed << (cells < kFew ? cells : cells / 1e6) << (cells < kFew ? " cells" : " million cells");
  return text.str();
}

// Bytes of memory for a node of the octree: the node, its queue entry, its fit's vector and its part of the final
// arrays.
constexpr double kBytesPerNode = 250;
constexpr double kBytesPerCoefficient = 8;

constexpr double kTolerance = 1.5;  // estimates of the final memory may exceed the allowed memory by this factor

/// Converts the target error τ, which refers to a mesh of size 2, to a mesh of size `referenceLength`.
double scaledTarget(double weighted, double referenceLength) {
  if (weighted == 0) return 0;
  const double target = weighted * std::pow(referenceLength / 2, 5);
  if (!(target >= std::numeric_limits<double>::min()) || !std::isfinite(target))
    refuseOptions("target error ", weighted, " for a surface of size ", referenceLength,
                  " is beyond double precision: scale the mesh, or normalize it");
  return target;
}

/// Throws `Error` for the first setting that is out of its range.
void checkRanges(const BuildOptions& options) {
  for (const BuildSetting& setting : buildSettings()) {
    if (!setting.isChecked) continue;
    for (const double number : setting.get(options)) {
      const bool aboveMinimum = setting.minimumExcluded ? number > setting.minimum : number >= setting.minimum;
      if (aboveMinimum && number <= setting.maximum && std::isfinite(number)) continue;
      std::string name(setting.name);
      std::ranges::replace(name, '-', ' ');
      std::ostringstream upper;
      if (std::isfinite(setting.maximum)) upper << ", up to " << setting.maximum;
      refuseOptions(name, " ", number, ": expected a number ", setting.minimumExcluded ? "above " : "of at least ",
                    setting.minimum, upper.str());
    }
  }
}

bool hasEnd(const BuildOptions& options) {
  return std::ranges::any_of(buildSettings(), [&](const BuildSetting& setting) {
    return setting.ending != BuildSetting::Ending::none && !setting.get(options).empty();
  });
}

/// Throws `Error` if a setting changes the field after its tolerance or its maximum error was reached.
void checkOutlived(const BuildOptions& options) {
  const char* reached = options.tolerance > 0 ? "tolerance" : options.maxError > 0 ? "maximum error" : nullptr;
  if (reached == nullptr) return;
  for (const char* later :
       {options.continuityWeight ? "weak continuity" : nullptr, options.enrich ? "enrich" : nullptr})
    if (later != nullptr)
      refuseOptions("a ", reached, " does not outlive ", later, ": leave out ", later, " or the ", reached);
  if (options.tolerance > 0 && options.band > 0)
    refuseOptions("a tolerance is kept in the whole domain: leave out the band or the tolerance");
}

/// Throws `Error` if the settings that determine when the construction ends contradict each other.
void checkEnds(const BuildOptions& options) {
  const NearFarError byDistance = options.targetError.byDistance();
  if ((byDistance.near > 0) != (byDistance.far > 0))
    refuseOptions("near error and far error belong together: give both");
  if (byDistance.near > byDistance.far)
    refuseOptions("near error ", byDistance.near, " is above far error ", byDistance.far,
                  ": expected a field that is at least as exact near the surface");
  if (!hasEnd(options))
    refuseOptions(
        "target error 0: expected a number above 0, or another end: near and far error, maximum error, bytes, steps");
  if (options.tolerance > 0 && (options.maxError > 0 || options.maxBytes || options.targetError.isByDistance()))
    refuseOptions("a tolerance decides alone: leave out maximum error, bytes, near and far error");
  checkOutlived(options);
  if (options.certified && options.blend > 0)
    refuseOptions("blending changes what is certified: leave out blending or the certificate");
  if (options.estimator == Estimator::checked && options.trialSamples == TrialSamples::own)
    refuseOptions(
        "the checked estimator needs trials by the children's samples: take the estimator embedded or residual");
  if (options.criterion != Criterion::optimal) return;
  if (options.trialSamples == TrialSamples::own)
    refuseOptions("the optimal criterion needs trials by the children's samples: leave out the paper's settings");
  if (options.maxError > 0)
    refuseOptions(
        "the optimal criterion takes refinements back by mean squares, which a maximum error does not allow: take "
        "the paper's criterion");
  if (options.targetError.isNone() && !options.maxBytes)
    refuseOptions("the optimal criterion needs a target: a target error, near and far error, or bytes");
}

/// Returns the part of the byte limit that is left for nodes and coefficients. The lookup grid takes the rest:
/// one entry for each base cell or, if that is more, an eighth of the bytes of nodes and coefficients, and a sixteenth
/// if they are not quantized. Blending makes each entry half as large again.
double limitWithoutLookup(const BuildOptions& options) {
  if (!options.maxBytes) return HUGE_VAL;
  const auto limit = double(*options.maxBytes);
  const double entries = options.blend > 0 ? 1.5 : 1;
  const bool isFloat =
      options.coefficients == CoefficientType::float32 || options.coefficients == CoefficientType::float64;
  const double share = isFloat ? 16 : 8;
  const double baseEntries = 8 * baseCells(options);
  return std::min(limit / (1 + entries / share), limit - entries * baseEntries);
}

}  // namespace

ErrorGoal errorGoal(const BuildOptions& options, double referenceLength) {
  const NearFarError byDistance = options.targetError.byDistance();
  return {scaledTarget(options.targetError.weighted(), referenceLength), byDistance.near * byDistance.near,
          byDistance.far * byDistance.far};
}

int startDegree(const BuildOptions& options) {
  if (isHp(options.strategy)) return std::min(2, options.maxDegree);
  return options.strategy == Strategy::h1 ? 1 : 2;
}

int leastDegree(const BuildOptions& options) { return isHp(options.strategy) ? 1 : startDegree(options); }

int mostDegree(const BuildOptions& options) {
  return isHp(options.strategy) ? options.maxDegree : startDegree(options);
}

static void requireGridMemory(const BuildOptions& options) {
  const double cells = baseCells(options);
  const double bytesPerCell = kBytesPerNode + kBytesPerCoefficient * coefficientCount(startDegree(options));
  constexpr double kGridRoom = 2;  // the octree takes some memory besides the grid
  const double allowed = allowedMemory(options), byMemory = allowed / bytesPerCell;
  const double byNumbers = 0xffffffff / double(coefficientCount(startDegree(options)));
  if (cells <= std::min(byMemory, byNumbers)) return;
  std::ostringstream grid;
  grid << "base grid " << options.grid[0] << " x " << options.grid[1] << " x " << options.grid[2] << " has " << cells
       << " cells ";
  if (byNumbers < byMemory)
    refuseOptions(grid.str(), "with more than 2^32 coefficients: take at most ", std::floor(std::cbrt(byNumbers)),
                  " an axis");
  grid << "and would need " << bytesText(cells * bytesPerCell) << ", more than the " << bytesText(allowed)
       << " allowed: ";
  const double least = cells * bytesPerCell;
  refuseMemory(std::min(kGridRoom * least, std::max(least, hpsdf::allowedMemory())), grid.str(),
               "take a coarser grid, at most ", std::max(1.0, std::floor(std::cbrt(byMemory))), " an axis");
}

std::size_t ByteBudget::finalCoefficients(const Fit& fit) const {
  return fit.isFinal ? fit.coefficients.size() : finalCoefficients(fit.degree);
}

static double octreeBytes(const MemoryNeed& need) {
  return kBytesPerNode * double(need.nodes) + kBytesPerCoefficient * double(need.coefficients);
}

/// Returns the factor by which the octree is taken to grow.
static double growthFactor(const MemoryNeed& need, const BuildOptions& options) {
  // The likely memory is too great by a factor of 30 at times, while the facets of a smooth shape come into sight. It
  // serves to refuse a construction that chases noise soon after its start; the lower bound passes the allowed memory
  // only when most of the time is spent.
  constexpr double kLikelyTolerance = 50;
  const double likely = double(need.fixedBytes) + octreeBytes(need) * need.likelyFactor;
  const bool isLikelyTooMuch = likely > kLikelyTolerance * allowedMemory(options);
  return isLikelyTooMuch ? std::max(need.likelyFactor, need.growthFactor) : need.growthFactor;
}

bool hasMemory(const MemoryNeed& need, const BuildOptions& options) {
  const double fixed = double(need.fixedBytes), bytes = octreeBytes(need), most = allowedMemory(options);
  return fixed + bytes <= most && fixed + bytes * growthFactor(need, options) <= kTolerance * most;
}

void requireMemory(const MemoryNeed& need, const BuildOptions& options) {
  if (hasMemory(need, options)) return;
  constexpr double kRoomBesideDistance = 1e8;  // enough for most meshes at usual settings
  const double fixed = double(need.fixedBytes), most = allowedMemory(options);
  if (fixed > most)
    refuseMemory(fixed + kRoomBesideDistance, "the distance that the field is made from holds ", bytesText(fixed),
                 " of memory, more than the ", bytesText(most), " allowed: simplify the mesh");
  const double bytes = octreeBytes(need), factor = growthFactor(need, options), finally = fixed + bytes * factor;
  const bool isMostlyBaseGrid = baseCells(options) > 0.5 * double(need.nodes) * factor;
  refuseMemory(fixed + bytes * std::max(need.likelyFactor, need.growthFactor), "about ",
               cellsText(double(need.nodes) * factor), " and ", bytesText(finally),
               " of memory are needed, more than the ", bytesText(most), " allowed: take ",
               isMostlyBaseGrid        ? "a coarser grid"
               : options.tolerance > 0 ? "a larger tolerance"
                                       : "a larger target error or a lower maximum depth");
}

double mostNodes(const BuildOptions& options) {
  return kOverestimateBySamples * allowedMemory(options) / kBytesPerNode;
}

void requireMemoryForExact(const ExactEstimate& estimate, std::size_t fixedBytes, const BuildOptions& options) {
  // Lists are in memory twice when the arrays of the field are made.
  const double bytes = kBytesPerNode * estimate.nodes + 2 * estimate.listBytes, most = allowedMemory(options);
  if (bytes <= estimate.overestimate * most) return;
  // An estimate from samples is of all exact leaves. A count is of those so far; samples suggested that all take at
  // most this many times the limit.
  const double all = estimate.overestimate > 1 ? bytes : std::max(bytes, kOverestimateBySamples * most);
  refuseMemory(double(fixedBytes) + all, "the exact cells near the surface need more than the ", bytesText(most),
               " of memory allowed: take strategy hp, more exact-triangles a cell, a smaller exact-within or a lower "
               "maximum depth");
}

double referenceLength(const Source& source, const Box& domain) {
  if (source.box.isEmpty()) return domain.sizes().maxCoeff() / 1.1;
  const double longest = source.box.sizes().maxCoeff();
  if (!(longest > 0) || !std::isfinite(longest)) throw Error(ErrorKind::mesh, source.name, "the surface has no extent");
  return longest;
}

bool mayHaveExactLeaves(const DistanceFunction& distance, double referenceLength) {
  // Queries of exact leaves square lengths in single precision.
  constexpr double kShortest = 1e-16, kLongest = 1e18;
  const TriangleSearch* search = distance.triangleSearch();
  return search != nullptr && search->hasSigns() && referenceLength > kShortest && referenceLength < kLongest;
}

ByteBudget::ByteBudget(const BuildOptions& options)
    : options_(options),
      coefficientBytes_(options.coefficients == CoefficientType::float64 ? sizeof(double) : sizeof(float)),
      limit_(limitWithoutLookup(options)) {}

double ByteBudget::nodeBytes() const {
  return 8 + (options_.blend > 0 ? 4 : 0) + (options_.bounds ? double(sizeof(CellBound)) : 0);
}

double ByteBudget::growthLimit(double exactBytes) const {
  // Before pruning, the field may exceed the byte limit by this factor, so that there are refinements from which
  // pruning can choose. The factor was found by measurements, like `kGrowth`.
  constexpr double kByteGrowth = 1.6;
  return options_.criterion == Criterion::optimal ? (limit_ - exactBytes) * kByteGrowth + exactBytes : limit_;
}

void ByteBudget::requireRoomForFirstCells(double bytes, double leastBytes, double exactBytes) const {
  const double missing = std::max(leastBytes - limit_, bytes - growthLimit(exactBytes));
  if (!(missing > 0)) return;
  const double cells = baseCells(options_);
  const bool mayLower = options_.criterion == Criterion::optimal;
  const double baseGrid = cells * leafBytes(mayLower ? leastDegree(options_) : startDegree(options_));
  if (exactBytes > 0 && baseGrid <= limit_)
    refuseOptions("the exact cells near the surface and the cells around them take more than ", *options_.maxBytes,
                  " bytes: allow ", static_cast<std::uint64_t>(double(*options_.maxBytes) * (1 + missing / limit_)) + 1,
                  ", more exact-triangles a cell, or a smaller exact-within");
  refuseOptions("the base grid alone takes more than ", *options_.maxBytes,
                " bytes: allow more, or take a coarser grid");
}

CoefficientType ByteBudget::coefficientType() const {
  const bool isFree = options_.coefficients == CoefficientType::automatic;
  return isFree && options_.maxBytes ? CoefficientType::quantized : options_.coefficients;
}

void checkOptions(const Box& domain, const BuildOptions& options) {
  checkRanges(options);
  checkEnds(options);
  if (std::ranges::find(options.grid, 0u) != options.grid.end())
    refuseOptions("base grid 0: expected at least 1 cell an axis");
  if (domain.isEmpty() || !domain.min().allFinite() || !domain.max().allFinite() || !(domain.sizes().minCoeff() > 0) ||
      !std::isfinite(domain.diagonal().squaredNorm()))
    refuseOptions("the domain is empty, flat or not finite: expected lower < upper on every axis");
  requireGridMemory(options);
  const double across = double(*std::ranges::max_element(options.grid)) * std::ldexp(1.0, options.maxDepth);
  if (across > 0x1p32)
    refuseOptions("a grid of ", *std::ranges::max_element(options.grid), " cells halved ", options.maxDepth,
                  " times is finer than 2^32 cells an axis: take a coarser grid or a lower maximum depth");
}

}  // namespace hpsdf::detail
