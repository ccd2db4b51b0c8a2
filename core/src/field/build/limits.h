#pragma once
// Checks of the build settings, limits of the memory and of the field's size, and values that follow from the settings.

#include <algorithm>
#include <cstddef>

#include "field/cells/cell_fit.h"
#include "field/cells/exact_leaves.h"
#include "field/nearness.h"
#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"

namespace hpsdf::detail {

/// If pruning follows, the octree is refined until the error is this fraction of the target. Compared with no pruning,
/// a fraction of 0.7 means 1.3 times as many evaluations of the exact distance and 0.49 times as many coefficients; 0.5
/// means 1.7 and 0.48 times as many (mesh bunny_69k, τ = 1e-6).
constexpr double kGrowth = 0.7;

/// The degree of the base cells before any refinement.
int startDegree(const BuildOptions& options);
/// Return the lowest and the highest degree that a leaf may have.
int leastDegree(const BuildOptions& options);
int mostDegree(const BuildOptions& options);

/// Returns the length L by which the target error τ is scaled (see `BuildOptions::targetError`). Throws `Error`
/// for a surface without extent.
double referenceLength(const Source& source, const Box& domain);

/// Returns true if a field of this distance can have exact leaves.
bool mayHaveExactLeaves(const DistanceFunction& distance, double referenceLength);

/// Returns the errors at which a construction ends, in the units of its field.
ErrorGoal errorGoal(const BuildOptions& options, double referenceLength);

/// The memory that a construction needs now, and by how much it will grow.
struct MemoryNeed {
  std::size_t nodes = 0, coefficients = 0;
  double growthFactor = 1;     ///< lower bound of the octree's final size divided by its present size
  double likelyFactor = 1;     ///< the same, as a likely value
  std::size_t fixedBytes = 0;  ///< bytes besides the octree
};

/// Returns true if the construction keeps to the allowed memory now and, as far as can be told, at the end.
bool hasMemory(const MemoryNeed& need, const BuildOptions& options);
/// Throws `Error` unless `hasMemory`.
void requireMemory(const MemoryNeed& need, const BuildOptions& options);

/// Returns the number of nodes that an estimated octree may have without being refused.
double mostNodes(const BuildOptions& options);

/// Throws `Error` if the exact leaves exceed the allowed memory, or certainly will. `fixedBytes` are held besides the
/// octree; they count only in the memory that the error suggests.
void requireMemoryForExact(const ExactEstimate& estimate, std::size_t fixedBytes, const BuildOptions& options);

/// Computes the bytes of the finished field from its numbers of nodes and coefficients, as far as these are not
/// quantized. The lookup grid and the triangles of exact leaves do not count.
class ByteBudget {
 public:
  explicit ByteBudget(const BuildOptions& options);

  /// Returns the degree that a leaf of degree `degree` has in the finished field. It is one higher if the option
  /// `enrich` raises all degrees at the end.
  int finalDegree(int degree) const {
    return options_.enrich ? std::max(degree, std::min(degree + 1, options_.maxDegree)) : degree;
  }
  /// Returns the number of coefficients that a leaf of degree `degree` has in the finished field.
  std::size_t finalCoefficients(int degree) const { return std::size_t(coefficientCount(finalDegree(degree))); }
  /// Returns the number of coefficients that a leaf with this fit has in the finished field.
  std::size_t finalCoefficients(const Fit& fit) const;
  /// Returns the bytes of a node, including those for blending and for error bounds if the field has them.
  double nodeBytes() const;
  double leafBytes(int degree) const { return bytes(1, double(finalCoefficients(degree))); }
  double bytes(double nodes, double coefficients) const {
    return nodeBytes() * nodes + coefficientBytes_ * coefficients;
  }
  /// Returns the bytes of a coefficient that is not quantized. Quantized ones must be counted.
  double coefficientBytes() const { return coefficientBytes_; }

  /// Returns the byte limit for nodes, coefficients and the triangles of exact leaves, or infinity if there is no
  /// limit.
  double limit() const { return limit_; }
  /// Returns the byte limit while the octree grows. It is greater than `limit` if pruning follows. `exactBytes` are
  /// the bytes of triangles and their lists, which pruning leaves as they are.
  double growthLimit(double exactBytes) const;
  /// Throws `Error` if the first cells take too many bytes: if `bytes` exceeds the growth limit, or if
  /// `leastBytes`, the fewest that pruning can leave, exceeds the limit. Both include `exactBytes`.
  void requireRoomForFirstCells(double bytes, double leastBytes, double exactBytes) const;

  /// Returns true if the finished field's coefficients are quantized where that is possible.
  bool mayQuantize() const {
    return coefficientType() == CoefficientType::quantized || coefficientType() == CoefficientType::automatic;
  }

  /// Returns the precision of the finished field's coefficients. They are quantized, or else float, if bytes are
  /// limited and no precision is set.
  CoefficientType coefficientType() const;

 private:
  const BuildOptions& options_;
  double coefficientBytes_;
  double limit_;
};

/// Throws `Error` if the domain or a setting is out of range. The error names the first fault; see `checkBuild`.
void checkOptions(const Box& domain, const BuildOptions& options);

}  // namespace hpsdf::detail
