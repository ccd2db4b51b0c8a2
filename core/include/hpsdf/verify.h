#pragma once
// The error of a field, measured at random points against the exact distance rather than estimated.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "hpsdf/detail/exact_samples.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// The distribution of |f − Φ| over samples, in units of length.
struct ErrorFigures {
  std::size_t samples = 0;
  double rms = 0;
  double mean = 0;
  double max = 0;
  std::map<double, double> percentiles = {};  ///< 50, 90, 99 and 99.9 → percentile
};

/// Samples at which f and Φ have different signs. Between the zeros of f and of Φ such samples are inevitable; they are
/// defects only where |Φ| exceeds the field's error.
struct SignFigures {
  std::size_t mismatches = 0;
  double farthest = 0;      ///< largest |Φ| of a mismatch
  double threshold = 0;     ///< the |Φ| beyond which a mismatch is a defect
  std::size_t defects = 0;  ///< number of mismatches with |Φ| above the threshold
};

/// The length of ∇f at all samples and its angle with ∇Φ at some of them.
struct GradientFigures {
  double meanLength = 0;
  double lengthErrorRms = 0;  ///< RMS of ‖∇f‖ − 1
  double maxLength = 0;
  std::size_t angles = 0;  ///< number of samples at which the angle was measured
  double meanAngleDegrees = 0;
  double angle99Degrees = 0;  ///< 99th percentile of the angles
  double maxAngleDegrees = 0;
  double maxPairSlope = 0;  ///< greatest |f(x) − f(y)|/|x − y| of consecutive samples, which includes jumps
};

struct SampleFigures {
  ErrorFigures error;
  SignFigures signs;
  GradientFigures gradient;
};

/// The bounds of the cells (`CellBound`), compared with samples. Cells without a sample do not count.
struct BoundFigures {
  std::size_t violations = 0;  ///< number of samples whose error or gradient exceeds the bound of their cell
  std::size_t cells = 0;
  double medianBound = 0;  ///< median of the cells' error bounds
  double medianWorst = 0;  ///< median of the cells' greatest sampled errors
};

/// A sample with a large error and its cell.
struct WorstPoint {
  Vector3 point;
  double exact;  ///< Φ at the point
  double value;  ///< f at the point
  std::uint32_t cell;
  int degree;
  int depth;

  double error() const { return value > exact ? value - exact : exact - value; }
};

struct VerifyOptions {
  std::size_t points = 1'000'000;     ///< number of samples, half uniform, half near the surface; at least 2
  std::uint64_t seed = 1;             ///< seed of the random points
  double near = 0;                    ///< greatest distance of near points; 0: 1 % of the surface's longest side
  double band = 0;                    ///< greatest |Φ| of samples; 0: samples of the whole domain
  double signBound = 0;               ///< `SignFigures::threshold`; 0: ten times the RMS error of the near points
  std::size_t worst = 10;             ///< number of worst points, each in a different cell
  std::size_t anglePoints = 100'000;  ///< number of samples at which the directions of gradients are compared
  int threads = 0;                    ///< greatest number of threads; 0: all that the machine offers
};

struct Verification {
  double near = 0;                     ///< the `VerifyOptions::near` that was used
  SampleFigures uniform;               ///< figures over points that are uniform in the domain or the band
  SampleFigures nearSurface;           ///< figures over points near the surface
  std::optional<BoundFigures> bounds;  ///< figures over all points; empty if the field has no bounds
  std::vector<WorstPoint> worst;       ///< points with the greatest |f − Φ|, greatest first
};

/// The exact surface that a field is compared with. The referenced objects must outlive it.
struct VerifiedSurface {
  const DistanceFunction& distance;                       ///< Φ
  std::function<Vector3(const Vector3&, double)> normal;  ///< returns ∇Φ from x and Φ(x); zero where it is unknown
  const TriangleMesh& mesh;                               ///< surface near which points are drawn, in the field's units
};

/// Measures |f − Φ| at samples. The result does not depend on `threads` (0: all that the machine offers).
ErrorFigures measureError(const Field& field, const ExactSamples& samples, int threads = 0);

/// Measures a field's errors, signs, gradients and bounds; `findJumps` measures its jumps. The result does not depend
/// on the number of threads. Throws `Error` as `sampleUniform` and `sampleNear` do and for options out of range,
/// `Cancelled` when `progress` says so.
Verification verify(const Field& field, const VerifiedSurface& surface, const VerifyOptions& options = {},
                    const Progress& progress = {});

}  // namespace hpsdf
