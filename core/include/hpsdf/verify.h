#pragma once
// Measures the error of a field against the exact distance at random points, instead of estimating the error.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "hpsdf/detail/exact_samples.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// Statistics of the error |f − Φ| of a field f over samples, in units of length.
struct ErrorFigures {
  std::size_t samples = 0;
  double rms = 0;
  double mean = 0;
  double max = 0;
  std::map<double, double> percentiles = {};  ///< percentiles of the error; the keys are 50, 90, 99 and 99.9
};

/// Statistics of sign mismatches: samples at which the field f and the exact distance Φ have different signs.
/// Mismatches are inevitable between the zero sets of f and Φ. They are defects only if |Φ| exceeds the field's error.
struct SignFigures {
  std::size_t mismatches = 0;
  double farthest = 0;      ///< largest |Φ| of a mismatch
  double threshold = 0;     ///< the |Φ| beyond which a mismatch is a defect
  std::size_t defects = 0;  ///< number of mismatches with |Φ| above the threshold
};

/// Statistics of the gradient ∇f: its length at all samples, and its angle with ∇Φ at some of the samples.
struct GradientFigures {
  double meanLength = 0;
  double lengthErrorRms = 0;  ///< RMS of ‖∇f‖ − 1
  double maxLength = 0;
  std::size_t angles = 0;  ///< number of samples at which the angle was measured
  double meanAngleDegrees = 0;
  double angle99Degrees = 0;  ///< 99th percentile of the angles
  double maxAngleDegrees = 0;
  double maxPairSlope = 0;  ///< greatest |f(x) − f(y)|/|x − y| of consecutive samples x, y; includes jumps
};

struct SampleFigures {
  ErrorFigures error;
  SignFigures signs;
  GradientFigures gradient;
};

/// Comparison of the proven bounds of cells (`CellBound`) with the errors and gradients at samples. Cells that contain
/// no sample do not count.
struct BoundFigures {
  std::size_t violations = 0;  ///< number of samples whose error or gradient exceeds the bound of their cell
  std::size_t cells = 0;
  double medianBound = 0;  ///< median of the cells' error bounds
  double medianWorst = 0;  ///< median of the cells' greatest sampled errors
};

/// A sample with a large error, and the cell that contains the sample.
struct WorstPoint {
  Vector3 point;
  double exact;  ///< Φ at the point
  double value;  ///< f at the point
  std::uint32_t cell;
  int degree;
  int depth;

  double error() const { return value > exact ? value - exact : exact - value; }
};

/// Options of `measure`. The points depend on the seed, not on the number of threads.
struct MeasureOptions {
  /// Number of random points, half of them near the surface; 0: a twentieth of the points at which the construction
  /// evaluated Φ, but 20,000 to 100,000. Where winding numbers decide what is inside, it is a fortieth, 8,000 to
  /// 50,000. Measuring then takes about a tenth of the construction's time at most, if that is seconds. The share of
  /// the surface that is torn is measured at half as many points as are near it.
  std::size_t points = 0;
  /// Greatest distance of points near the surface from it; 0: the distance up to which the field's tolerance holds, at
  /// most an eighth of the domain's diagonal, or, without a tolerance, 1 % of the surface's longest side.
  double near = 0;
  std::uint64_t seed = 1;
  int threads = 0;  ///< greatest number of threads; 0: all that the machine offers
};

/// Measures the errors of a field against the signed distance Φ (`distance`) that it approximates. Points of the domain
/// are drawn apart for exact leaves and for polynomials, and their errors weighted by volume. Without triangles,
/// points near the surface are those of the domain at which |Φ| is small, and no share of the surface is torn. Throws
/// `Error` if Φ is not finite, and `Cancelled` when `progress` says so.
Measurement measure(const Field& field, const DistanceFunction& distance, const MeasureOptions& options = {},
                    const Progress& progress = {});

/// Returns the share of a surface that the field's jumps tear: the share of `sampleSurface`'s random points that lie in
/// a crack beside a face of their cell. It is 0 for a blended field, which is continuous.
double tornShare(const Field& field, const TriangleMesh& surface, const SampleOptions& options = {});

/// Returns the field with a measurement of it in its metadata.
Field withMeasurement(Field field, const Measurement& measurement);

/// Measures a field that `build` has made with these options, near the surface as far as errors near it were asked for,
/// and returns it with the measurement. Throws as `measure` does.
Field measured(Field field, const DistanceFunction& distance, const BuildOptions& options,
               const Progress& progress = {});

struct VerifyOptions {
  std::size_t points = 1'000'000;     ///< number of samples, half uniform, half near the surface; at least 2
  std::uint64_t seed = 1;             ///< seed of the random points
  double near = 0;                    ///< greatest distance of near samples; 0: 1 % of the surface's longest side
  double band = 0;                    ///< greatest |Φ| of samples; 0: samples of the whole domain
  double signBound = 0;               ///< `SignFigures::threshold`; 0: ten times the RMS error of the near samples
  std::size_t worst = 10;             ///< number of points with the largest errors, each in a different cell
  std::size_t anglePoints = 100'000;  ///< number of samples at which the directions of gradients are compared
  int threads = 0;                    ///< greatest number of threads; 0: all that the machine offers
};

struct Verification {
  double near = 0;                     ///< greatest distance of the near samples from the surface
  SampleFigures uniform;               ///< statistics of points that are uniform in the domain or the narrow band
  SampleFigures nearSurface;           ///< statistics of points near the surface
  std::optional<BoundFigures> bounds;  ///< statistics over all points; empty if the field has no bounds
  std::vector<WorstPoint> worst;       ///< points with the greatest |f − Φ|, greatest first
};

/// The exact surface with which a field is compared. The objects to which the members refer must outlive this
/// object.
struct VerifiedSurface {
  const DistanceFunction& distance;                       ///< Φ
  std::function<Vector3(const Vector3&, double)> normal;  ///< returns ∇Φ from x and Φ(x); zero where it is unknown
  const TriangleMesh& mesh;                               ///< surface near which points are drawn, in the field's units
};

/// Measures |f − Φ| at the samples. The result does not depend on `threads` (0: all that the machine offers).
ErrorFigures measureError(const Field& field, const ExactSamples& samples, int threads = 0);
/// Does the same for values f of a field that are known already, at points with the exact distances `distances`.
ErrorFigures measureError(std::span<const double> values, std::span<const double> distances, int threads = 0);

/// Measures the errors, signs, gradients and bounds of a field; `findJumps` measures its jumps. The result does
/// not depend on the number of threads. Throws `Error` for options out of range, and as `sampleUniform` and
/// `sampleNear` do. Throws `Cancelled` when `progress` says so.
Verification verify(const Field& field, const VerifiedSurface& surface, const VerifyOptions& options = {},
                    const Progress& progress = {});

}  // namespace hpsdf
