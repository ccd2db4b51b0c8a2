#include "field/precision/round_coefficients.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "basis/legendre.h"
#include "basis/orthonormal.h"
#include "basis/projection.h"
#include "field/query/evaluate.h"
#include "field/query/float_coefficients.h"
#include "field/query/quantized.h"

namespace hpsdf::detail {
namespace {

constexpr double kUnlimitedChange = std::numeric_limits<double>::infinity();
constexpr double kNegligible = 0.01;        // share of an error that is not counted
constexpr double kShareOfRms = 0.1;         // of the RMS error: as squares add up, the error grows by half a percent
constexpr double kShareOfMaximum = 0.01;    // of a maximum error
constexpr double kShareOfTolerance = 0.05;  // of a tolerance; polynomials make use of at most 93 % of it (`kMostRatio`)

/// Calls f(node, coefficients) for each leaf of a field with double coefficients that has a polynomial.
template <typename F>
void forEachPolynomial(const FieldData& field, const F& f) {
  const std::span<const double> coefficients = std::get<FieldArray<double>>(field.coefficients).all();
  query::visitNodes(field, [&](const query::OctreeNode& at) {
    const std::uint64_t bits = field.nodes[at.node];
    if (node::isLeaf(bits) && !node::isExact(bits))
      f(at, std::span(&coefficients[node::offset(bits)], std::size_t(coefficientCount(node::degree(bits)))));
    return true;
  });
}

/// Returns a bound of the change by quantizing. With a tolerance, it is the greatest change over the error that is
/// allowed there, times the tolerance.
double greatestChange(const FieldData& field, const query::Quantized& quantized, const QuantizationLimits& limits) {
  const AllowedError allowed = allowedError(field.metadata.settings, field.metadata.referenceLength);
  double greatest = 0;
  std::vector<double> after(coefficientCount(kMaxDegree));
  forEachPolynomial(field, [&](const query::OctreeNode& at, std::span<const double> c) {
    decodeLeaf(quantized.coefficients, quantized.nodes[at.node], after.data());
    for (std::size_t i = 0; i < c.size(); ++i) after[i] -= c[i];
    const int degree = node::degree(field.nodes[at.node]);
    const double change = std::abs(after[0]) + limits.greatestDeviation(after, degree);
    const double share = allowed.tolerance > 0 ? allowed.tolerance / allowed.at(limits.leastDistance(c, degree)) : 1;
    greatest = std::max(greatest, change * share);
  });
  return greatest;
}

QuantizationLimits limitsOf(const FieldData& field) {
  BuildOptions settings = field.metadata.settings;
  settings.blend = field.blend;
  return {settings, field.metadata.referenceLength, field.exact.offset};
}

/// Returns the greatest steps of a field's leaves that keep to the limits and to the RMS error, and those that are
/// given.
std::vector<double> greatestSteps(const FieldData& field, const QuantizationLimits& limits, const KeptSteps& kept,
                                  const AcrossParts& parts) {
  ExactSum volumes, integers;
  forEachPolynomial(field, [&](const query::OctreeNode& at, std::span<const double> c) {
    const double volume = query::cellSize(field, at.depth).prod();
    volumes.add(volume);
    integers.add(volume * double(c.size()));
  });
  parts.add(volumes);
  parts.add(integers);
  const QuantizedPart part{.volume = volumes.value(), .integers = integers.value()};
  const double forRms = field.metadata.hasEstimate() ? limits.stepForRms(part, field.metadata.rmsEstimate(field.domain))
                                                     : kUnlimitedChange;
  std::vector<double> steps(field.nodes.size());
  forEachPolynomial(field, [&](const query::OctreeNode& at, std::span<const double> c) {
    const double given = kept.steps.empty() ? 0 : kept.steps[at.node];
    steps[at.node] = given > 0 ? given : std::min(forRms, limits.greatestStep(c, node::degree(field.nodes[at.node])));
  });
  return steps;
}

/// Quantizes with steps that are all made greater until the coefficients take no more than `mostBytes`. Without such a
/// limit the steps are as given, and `fieldStep` is that of the field unless it is 0.
std::optional<query::Quantized> quantizedWithin(const FieldData& field, std::vector<double> steps, double mostBytes,
                                                double fieldStep, const AcrossParts& parts) {
  constexpr double kFactor = 1.05;
  constexpr int kMostTries = 500;  // The last step is 4e10 times the first, and all integers are 0.
  std::optional<query::Quantized> result = query::quantized(field, steps, fieldStep, parts);
  if (mostBytes < kUnlimitedChange && !steps.empty()) {
    // With steps that differ more, no factor would help.
    const double least = std::ldexp(*std::ranges::max_element(steps), -QuantizedCoefficients::kMostShift);
    for (double& step : steps) step = std::max(step, least);
  }
  const auto fits = [&] { return result && double(result->coefficients.bytes.size()) <= mostBytes; };
  for (int tries = 0; mostBytes < kUnlimitedChange && !fits() && tries < kMostTries; ++tries) {
    for (double& step : steps) step *= kFactor;
    result = query::quantized(field, steps);
  }
  return result;
}

/// Returns the least of the errors that the construction aimed at.
double leastError(const FieldData& field) {
  const BuildOptions& settings = field.metadata.settings;
  if (settings.tolerance > 0) return settings.tolerance;
  const double rms = field.metadata.rmsEstimate(field.domain);
  return settings.maxError > 0 ? std::min(rms, settings.maxError) : rms;
}

/// Quantizes the coefficients of a field as `CoefficientType::quantized` says. Returns false, and leaves the field as
/// it is, if that is not possible.
bool quantizeCoefficients(FieldData& field, double mostBytes, const KeptSteps& kept, const AcrossParts& parts) {
  FieldMetadata& metadata = field.metadata;
  const QuantizationLimits limits = limitsOf(field);
  std::optional<query::Quantized> quantized =
      quantizedWithin(field, greatestSteps(field, limits, kept, parts), mostBytes, kept.step, parts);
  if (!quantized) return false;
  metadata.roundingRms = query::quantizedRounding(field, quantized->nodes, quantized->coefficients, parts).rms;
  const double maxError = metadata.settings.maxError;
  if (metadata.settings.tolerance > 0 || maxError > 0) {
    // Less than a hundredth of a maximum error is left out. Rounding errors of the sums may exceed it slightly.
    constexpr double kRounding = 1.001;
    const double change = greatestChange(field, *quantized, limits);
    if (metadata.settings.tolerance > 0 || change > kRounding * kShareOfMaximum * maxError)
      metadata.measuredError += change;
  }
  query::take(std::move(*quantized), field);
  const bool mustBeShort = mostBytes < kUnlimitedChange;
  if (mustBeShort || query::vertexRounding(field.exact) < kNegligible * leastError(field))
    query::roundVertices(field.exact);
  return true;
}

}  // namespace

QuantizationLimits::QuantizationLimits(double blend) : shareOfRms_(kShareOfRms) {
  basis::legendreValues<double>(1 + 2 * blend, kMaxDegree, largest_.data());
  std::array<double, kMaxDegree + 1> byTotal{};  // sums over the terms of the same total degree
  for (int i = 0; i <= kMaxDegree; ++i)
    for (int j = 0; i + j <= kMaxDegree; ++j)
      for (int k = 0; i + j + k <= kMaxDegree; ++k)
        byTotal[i + j + k] += basis::norm(i, j, k) * largest_[i] * largest_[j] * largest_[k];
  double sum = 0;
  for (int degree = 0; degree <= kMaxDegree; ++degree) {
    sum += byTotal[degree];
    changeByStep_[degree] = sum / 2;  // an integer is wrong by half at most
  }
}

QuantizationLimits::QuantizationLimits(const AllowedError& tolerance, double blend) : QuantizationLimits(blend) {
  allowed_ = tolerance;
}

QuantizationLimits::QuantizationLimits(const BuildOptions& settings, double referenceLength, double exactOffset)
    : QuantizationLimits(allowedError(settings, referenceLength), settings.blend) {
  if (settings.continuityWeight) shareOfRms_ *= kWeaklyContinuousStep;
  if (settings.maxError > 0) max_ = kShareOfMaximum * settings.maxError;
  if (settings.strategy != Strategy::hpx || settings.tolerance > 0) return;
  // Beside exact leaves, polynomials have hardly an error, or one within the exact tolerance.
  constexpr double kFloatRounding = 0x1p-24;
  exactOffset_ = exactOffset;
  exactWithin_ = settings.exactWithin * referenceLength;
  nearlyExact_ = std::max(kFloatRounding, kShareOfTolerance * settings.exactTolerance) * referenceLength;
}

double QuantizationLimits::greatestDeviation(std::span<const double> coefficients, int degree) const {
  double sum = 0;
  basis::forEachCoefficient(degree, [&](int i, int j, int k, int index) {
    if (index > 0) sum += std::abs(coefficients[index]) * largest_[i] * largest_[j] * largest_[k];
  });
  return sum;
}

double QuantizationLimits::leastDistance(std::span<const double> coefficients, int degree) const {
  return std::max(0.0, std::abs(coefficients[0] + exactOffset_) - greatestDeviation(coefficients, degree));
}

double QuantizationLimits::greatestChange(std::span<const double> coefficients, int degree) const {
  if (allowed_.tolerance > 0) return kShareOfTolerance * allowed_.at(leastDistance(coefficients, degree));
  if (exactWithin_ < 0) return max_;
  return leastDistance(coefficients, degree) <= exactWithin_ ? std::min(max_, nearlyExact_) : max_;
}

double QuantizationLimits::greatestStep(std::span<const double> coefficients, int degree) const {
  const double step = greatestChange(coefficients, degree) / changeByStep_[degree];
  // A power of two is independent of the other leaves: a construction within a tolerance knows the bytes in advance.
  return allowed_.tolerance > 0 ? std::ldexp(1.0, std::ilogb(step)) : step;
}

double QuantizationLimits::stepForRms(const QuantizedPart& part, double rms) const {
  return part.stepForChange(shareOfRms_ * rms);
}

double QuantizedPart::stepForChange(double rms) const {
  // An integer is wrong by half at most, with a mean square of 1/12.
  return volume > 0 ? rms * std::sqrt(12 * volume / integers) : kUnlimitedChange;
}

void roundCoefficients(CoefficientType type, FieldData& field, double mostBytes, const KeptSteps& kept,
                       const AcrossParts& parts) {
  if (query::hasFloatVertices(field.exact)) query::roundVertices(field.exact);
  const bool mayQuantize = type == CoefficientType::quantized || type == CoefficientType::automatic;
  if (mayQuantize && quantizeCoefficients(field, mostBytes, kept, parts)) return;
  const query::Rounding rounding = query::floatRounding(field, parts);
  FieldMetadata& metadata = field.metadata;
  const bool spoilsMaximum = metadata.settings.maxError > 0 && rounding.max > kNegligible * metadata.settings.maxError;
  const double tolerance = metadata.settings.tolerance;
  const bool isNegligible = tolerance > 0
                                ? rounding.max < kNegligible * tolerance
                                : rounding.rms < kNegligible * metadata.rmsEstimate(field.domain) && !spoilsMaximum;
  if (type == CoefficientType::float64 || (type == CoefficientType::automatic && !isNegligible)) return;
  query::toFloat(field);
  query::roundVertices(field.exact);
  metadata.roundingRms = rounding.rms;
  const bool spoilsTolerance = tolerance > 0 && rounding.max > kNegligible * tolerance;
  if (spoilsMaximum || spoilsTolerance) metadata.measuredError += rounding.max;
}

}  // namespace hpsdf::detail
