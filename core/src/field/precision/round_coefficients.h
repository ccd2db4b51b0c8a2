#pragma once
// The precision in which a finished field keeps its coefficients.

#include <array>
#include <limits>
#include <span>
#include <vector>

#include "hpsdf/detail/field_data.h"
#include "util/across_parts.h"

namespace hpsdf::detail {

/// Weakly continuous fields take steps that are this much smaller.
inline constexpr double kWeaklyContinuousStep = 0.2;

/// Leaves with polynomials that are to be quantized.
struct QuantizedPart {
  double volume = 0;
  double integers = 0;  ///< sum of the volume of a leaf times its number of coefficients

  void add(double leafVolume, double coefficients) {
    volume += leafVolume;
    integers += leafVolume * coefficients;
  }

  /// Returns a step with which quantizing changes a field by `rms`, as RMS. Returns infinity if there are no
  /// polynomials.
  double stepForChange(double rms) const;
};

/// Tells by how much quantizing may change the polynomials of a field, besides its RMS error: by 5 % of a tolerance, by
/// 1 % of a maximum error, and close to a surface where the field is exact hardly at all.
class QuantizationLimits {
 public:
  QuantizationLimits(const AllowedError& tolerance, double blend);
  /// `referenceLength` is that of the surface, `exactOffset` the offset of exact leaves (`ExactTriangles::offset`).
  QuantizationLimits(const BuildOptions& settings, double referenceLength, double exactOffset);

  /// Returns the greatest change of a leaf's polynomial that quantizing may cause; infinity if there is no limit.
  double greatestChange(std::span<const double> coefficients, int degree) const;

  /// Returns the greatest step, in the orthonormal basis, that keeps to this limit.
  double greatestStep(std::span<const double> coefficients, int degree) const;

  /// Returns a step with which quantizing raises the RMS error `rms` of a field by half a percent, and hardly at all if
  /// the field is weakly continuous, because quantizing adds jumps. Returns infinity if there are no polynomials.
  double stepForRms(const QuantizedPart& part, double rms) const;

  /// Returns an upper bound of the difference between a leaf's polynomial and its mean, in the leaf and its blend
  /// zones.
  double greatestDeviation(std::span<const double> coefficients, int degree) const;

  /// Returns a lower bound of the distance from the surface there, as the polynomial gives it.
  double leastDistance(std::span<const double> coefficients, int degree) const;

 private:
  explicit QuantizationLimits(double blend);

  AllowedError allowed_;
  double shareOfRms_;
  double max_ = std::numeric_limits<double>::infinity();  ///< limit of the change in every leaf
  double exactOffset_ = 0;   ///< of exact leaves: subtracted from the distance to the surface
  double exactWithin_ = -1;  ///< distance from the surface up to which the field is exact; negative if it is not
  double nearlyExact_ = 0;   ///< limit of the change within this distance
  std::array<double, kMaxDegree + 1> largest_{};       ///< greatest |L_i| in a leaf and its blend zones
  std::array<double, kMaxDegree + 1> changeByStep_{};  ///< greatest change by a step of 1, by degree
};

/// Steps of quantized coefficients that are given: the step of the whole field, and those of some leaves.
struct KeptSteps {
  double step = 0;                 ///< 0 if no steps are given
  std::vector<double> steps = {};  ///< for each node; 0 for a leaf that may have any step
};

/// Rounds the coefficients of a field, and the vertices of its exact leaves, from double to `type`. Vertices that are
/// floats already are stored as floats in any case. Sets `roundingRms` and `measuredError` in the field's metadata.
/// Quantized coefficients take no more than `mostBytes`, at the price of a greater change, and have the steps that are
/// given by `kept`; not both can be asked for. If `field` is a part of a field without exact leaves, `parts` are all of
/// its parts, which are rounded at the same time, as the whole field would be.
void roundCoefficients(CoefficientType type, FieldData& field,
                       double mostBytes = std::numeric_limits<double>::infinity(), const KeptSteps& kept = {},
                       const AcrossParts& parts = {});

}  // namespace hpsdf::detail
