#include "field/build/limits.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include "field/build/refuse.h"
#include "field/continuity/weak_continuity.h"
#include "hpsdf/detail/memory.h"

namespace hpsdf {
namespace {

/// In bytes.
double allowedMemory(const BuildOptions& options) {
  const double most = hpsdf::allowedMemory();
  return options.memoryLimit ? std::min(most, double(*options.memoryLimit)) : most;
}

/// A number of cells that is about right.
std::string cellsText(double cells) {
  constexpr double kFew = 1e4;
  std::ostringstream text;
  text.precision(cells < kFew ? 0 : 2);
  text << std::fixed << (cells < kFew ? cells : cells / 1e6) << (cells < kFew ? " cells" : " million cells");
  return text.str();
}

// of the construction: a leaf's node, its queue entry, the vector of its fit, the final arrays
constexpr double kBytesPerNode = 250;
constexpr double kBytesPerCoefficient = 8;

/// τ in the field's own units^5.
double scaledTarget(const BuildOptions& options, double referenceLength) {
  if (options.targetError == 0) return 0;
  const double target = options.targetError * std::pow(referenceLength / 2, 5);
  if (!(target >= std::numeric_limits<double>::min()) || !std::isfinite(target))
    refuse("target error ", options.targetError, " for a surface of size ", referenceLength,
           " is beyond double precision: scale the mesh, or normalize it");
  return target;
}

void checkNumber(const char* name, double number) {
  if (!(number >= 0) || !std::isfinite(number)) refuse(name, " ", number, ": expected a number of at least 0");
}

/// What the construction is to end at.
void checkEnds(const BuildOptions& options) {
  checkNumber("target error", options.targetError);
  checkNumber("maximum error", options.maxError);
  checkNumber("near error", options.nearError);
  checkNumber("far error", options.farError);
  checkNumber("near distance", options.nearDistance);
  if ((options.nearError > 0) != (options.farError > 0)) refuse("near error and far error belong together: give both");
  if (options.nearError > options.farError)
    refuse("near error ", options.nearError, " is above far error ", options.farError,
           ": expected a field that is at least as exact near the surface");
  if (options.targetError == 0 && options.nearError == 0 && options.maxError == 0 && !options.maxBytes &&
      !options.maxSteps)
    refuse(
        "target error 0: expected a number above 0, or another end: near and far error, maximum error, bytes, steps");
  if (options.maxError > 0 && (options.continuityWeight || options.enrich))
    refuse("a maximum error does not outlive weak continuity or one degree more: leave out one of them");
  if (options.criterion != Criterion::optimal) return;
  if (options.trialSamples == TrialSamples::own)
    refuse("the optimal criterion needs trials by the children's samples: leave out the paper's settings");
  if (options.maxError > 0)
    refuse(
        "the optimal criterion takes refinements back by mean squares, which a maximum error does not allow: take "
        "the paper's criterion");
  if (options.targetError == 0 && options.nearError == 0 && !options.maxBytes)
    refuse("the optimal criterion needs a target: a target error, near and far error, or bytes");
}

}  // namespace

ErrorGoal errorGoal(const BuildOptions& options, double referenceLength) {
  return {scaledTarget(options, referenceLength), options.nearError * options.nearError,
          options.farError * options.farError};
}

double coefficientBytes(const BuildOptions& options) {
  return options.coefficients == CoefficientType::float64 ? sizeof(double) : sizeof(float);
}

int startDegree(const BuildOptions& options) {
  switch (options.strategy) {
    case Strategy::h1:
      return 1;
    case Strategy::h2:
      return 2;
    case Strategy::hp:
      break;
  }
  return std::min(2, options.maxDegree);
}

static void checkGridFitsMemory(const BuildOptions& options) {
  const double cells = double(options.grid[0]) * options.grid[1] * options.grid[2];
  const double bytesPerCell = kBytesPerNode + kBytesPerCoefficient * coefficientCount(startDegree(options));
  const double allowed = allowedMemory(options), byMemory = allowed / bytesPerCell;
  const double byNumbers = 0xffffffff / double(coefficientCount(startDegree(options)));
  if (cells <= std::min(byMemory, byNumbers)) return;
  std::ostringstream grid;
  grid << "base grid " << options.grid[0] << " x " << options.grid[1] << " x " << options.grid[2] << " has " << cells
       << " cells ";
  if (byNumbers < byMemory)
    refuse(grid.str(), "with more than 2^32 coefficients: take at most ", std::floor(std::cbrt(byNumbers)), " an axis");
  grid << "and would need " << bytesText(cells * bytesPerCell) << ", more than the " << bytesText(allowed)
       << " allowed: ";
  if (byMemory < 1) refuse(grid.str(), "allow more memory");
  refuse(grid.str(), "take at most ", std::floor(std::cbrt(byMemory)), " an axis, or allow more memory");
}

void checkFitsMemory(const Growth& growth, const BuildOptions& options) {
  constexpr double kDoubt = 1.5;  // about what is yet to come
  const double held = double(growth.held), most = allowedMemory(options);
  if (held > most)
    refuse("the distance that the field is made from holds ", bytesText(held), " of memory, more than the ",
           bytesText(most), " allowed: simplify the mesh, or allow more memory");
  const double bytes = kBytesPerNode * double(growth.nodes) + kBytesPerCoefficient * double(growth.coefficients);
  const double needed = held + bytes * growth.times;
  if (held + bytes <= most && needed <= kDoubt * most) return;
  refuse("about ", cellsText(double(growth.nodes) * growth.times), " and ", bytesText(needed),
         " of memory are needed, more than the ", bytesText(most),
         " allowed: take a larger target error or a lower maximum depth, or allow more memory");
}

double referenceLength(const Source& source, const Box& domain) {
  if (source.box.isEmpty()) return domain.sizes().maxCoeff() / 1.1;
  const double longest = source.box.sizes().maxCoeff();
  if (!(longest > 0) || !std::isfinite(longest)) throw Error(source.name + ": the surface has no extent");
  return longest;
}

void checkOptions(const Box& domain, const BuildOptions& options) {
  checkEnds(options);
  if (std::ranges::find(options.grid, 0u) != options.grid.end())
    refuse("base grid 0: expected at least 1 cell an axis");
  checkNumber("nearness", options.nearness);
  if (options.maxDegree < 1 || options.maxDegree > kMaxDegree)
    refuse("maximum degree ", options.maxDegree, ": expected 1 to ", kMaxDegree);
  if (options.maxDepth < 0 || options.maxDepth > kMaxDepth)
    refuse("maximum depth ", options.maxDepth, ": expected 0 to ", kMaxDepth);
  if (options.quadrature < 2 || options.quadrature > 8)
    refuse("quadrature ", options.quadrature, ": expected an order of 2 to 8 times the degree");
  if (!(options.band >= 0) || !std::isfinite(options.band))
    refuse("band ", options.band, ": expected a width of at least 0");
  if (options.continuityWeight) checkWeakContinuity({.weight = *options.continuityWeight});
  if (!(options.blend >= 0 && options.blend <= kMaxBlend))
    refuse("blend ", options.blend, ": expected a part of a cell's edges, 0 to ", kMaxBlend);
  if (options.threads < 0) refuse("threads ", options.threads, ": expected 0 (all) or more");
  if (domain.isEmpty() || !domain.min().allFinite() || !domain.max().allFinite() || !(domain.sizes().minCoeff() > 0) ||
      !std::isfinite(domain.diagonal().squaredNorm()))
    refuse("the domain is empty, flat or not finite: expected lower < upper on every axis");
  checkGridFitsMemory(options);
  const double across = double(*std::ranges::max_element(options.grid)) * std::ldexp(1.0, options.maxDepth);
  if (across > 0x1p32)
    refuse("a grid of ", *std::ranges::max_element(options.grid), " cells halved ", options.maxDepth,
           " times is finer than 2^32 cells an axis: take a coarser grid or a lower maximum depth");
}

}  // namespace hpsdf
