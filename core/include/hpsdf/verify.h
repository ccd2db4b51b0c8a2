#pragma once
// How wrong a field is: measured at random points against the exact distance, rather than estimated.

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

/// |f − Φ| over samples.
struct ErrorFigures {
  std::size_t samples = 0;
  double rms = 0;
  double mean = 0;
  double max = 0;
  std::map<double, double> percentiles = {};  ///< 50, 90, 99 and 99.9 → so many percent of the errors are no larger
};

/// Where f and Φ have different signs. Between two zeros that lie within the field's error of each other this must
/// be so: it is a defect only where |Φ| is beyond that error.
struct SignFigures {
  std::size_t mismatches = 0;
  double deepest = 0;           ///< largest |Φ| among them
  double beyond = 0;            ///< the |Φ| from which they count as defects
  std::size_t beyondCount = 0;  ///< those with a greater |Φ|
};

/// Of ∇f: its length at all samples, its angle with ∇Φ at some of them.
struct GradientFigures {
  double meanLength = 0;
  double lengthErrorRms = 0;  ///< of ‖∇f‖ − 1
  double maxLength = 0;
  std::size_t angles = 0;  ///< samples at which the angle was measured
  double meanAngleDegrees = 0;
  double angle99Degrees = 0;  ///< 99 percent of the angles are no larger
  double maxAngleDegrees = 0;
  double maxPairSlope = 0;  ///< greatest |f(x) − f(y)|/|x − y| of two neighbours in the list: sees jumps too
};

struct SampleFigures {
  ErrorFigures error;
  SignFigures signs;
  GradientFigures gradient;
};

/// What a field says for certain (`CellBound`), held against samples. Cells without a sample do not count.
struct BoundFigures {
  std::size_t violations = 0;  ///< samples with a greater error than their cell's bound, or a steeper gradient
  std::size_t cells = 0;
  double medianBound = 0;  ///< over cells
  double medianWorst = 0;  ///< over cells, of the greatest error among a cell's samples
};

/// A bad point, and its cell.
struct WorstPoint {
  Vector3 point;
  double exact;  ///< Φ
  double value;  ///< f
  std::uint32_t cell;
  int degree;
  int depth;

  double error() const { return value > exact ? value - exact : exact - value; }
};

struct VerifyOptions {
  std::size_t points = 1'000'000;  ///< half of them uniform, half near the surface; at least 2
  std::uint64_t seed = 1;
  double near = 0;         ///< radius of the ball of near points; 0: a hundredth of the surface's longest side
  double band = 0;         ///< look only where |Φ| is at most this; 0: everywhere
  double signBound = 0;    ///< `SignFigures::beyond`; 0: ten times the near points' RMS error
  std::size_t worst = 10;  ///< how many of the worst points to list, each from a cell of its own
  std::size_t anglePoints = 100'000;  ///< of all points, at which gradients are compared
  int threads = 0;                    ///< at most; 0: all that the machine offers. The result does not depend on it.
};

struct Verification {
  double near = 0;        ///< as used
  SampleFigures uniform;  ///< over points that are uniform in the domain (or the band)
  SampleFigures nearSurface;
  std::optional<BoundFigures> bounds;  ///< over both kinds of points; nothing where the field keeps none
  std::vector<WorstPoint> worst;       ///< by |f − Φ|, of both kinds of points, worst first
};

/// What a field is measured against. What is referred to must live as long.
struct VerifiedSurface {
  const DistanceFunction& distance;                       ///< Φ
  std::function<Vector3(const Vector3&, double)> normal;  ///< ∇Φ at x, Φ(x) given; zero where it is not known
  const TriangleMesh& mesh;                               ///< where near points are drawn; of the field's units
};

/// |f − Φ| at samples; as deterministic as these.
ErrorFigures measureError(const Field& field, const ExactSamples& samples, int threads = 0);

/// All figures but jumps, which `findJumps` has. Throws `Error` as the two `sample…` functions do and for options out
/// of range, `Cancelled` when progress says so.
Verification verify(const Field& field, const VerifiedSurface& surface, const VerifyOptions& options = {},
                    const Progress& progress = {});

}  // namespace hpsdf
