#pragma once
// Checks of settings, limits of memory and bytes, and figures that follow from the settings.

#include <algorithm>
#include <cstddef>

#include "field/nearness.h"
#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"

namespace hpsdf::detail {

/// Where pruning follows, the growth ends at this fraction of the error goal. On bunny_69k at τ = 1e-6, a fraction of
/// 0.7 takes 1.3 times the evaluations of Φ for 0.49 times the coefficients; 0.5 takes 1.7 times for 0.48 times.
constexpr double kGrowth = 0.7;

/// The degree of the base cells before any refinement.
int startDegree(const BuildOptions& options);
/// The lowest and highest degree of a leaf.
int leastDegree(const BuildOptions& options);
int mostDegree(const BuildOptions& options);

/// L, by which τ is scaled (see `BuildOptions::targetError`). Throws `Error` for a surface without extent.
double referenceLength(const Source& source, const Box& domain);

/// The goal in the field's own units.
ErrorGoal errorGoal(const BuildOptions& options, double referenceLength);

/// Memory that a construction holds, and its growth.
struct MemoryNeed {
  std::size_t nodes = 0, coefficients = 0;
  double growthFactor = 1;     ///< lower bound of the octree's final size divided by its present size
  std::size_t fixedBytes = 0;  ///< bytes besides the octree
};

/// Throws `Error` if the octree and the fixed bytes exceed the allowed memory, or will exceed it at the end.
void requireMemory(const MemoryNeed& need, const BuildOptions& options);

/// Counts the bytes of the finished field by its nodes and coefficients, without its lookup grid.
class ByteBudget {
 public:
  explicit ByteBudget(const BuildOptions& options);

  /// A leaf's degree in the finished field: one higher where leaves are enriched.
  int finalDegree(int degree) const {
    return options_.enrich ? std::max(degree, std::min(degree + 1, options_.maxDegree)) : degree;
  }
  /// Number of coefficients that the finished field keeps of a leaf.
  std::size_t finalCoefficients(int degree) const { return std::size_t(coefficientCount(finalDegree(degree))); }
  /// Bytes of a node, including its blend extent and bound if the field has them.
  double nodeBytes() const;
  double leafBytes(int degree) const { return bytes(1, double(finalCoefficients(degree))); }
  double bytes(double nodes, double coefficients) const {
    return nodeBytes() * nodes + coefficientBytes_ * coefficients;
  }

  /// The limit for nodes and coefficients; infinite without a limit.
  double limit() const { return limit_; }
  /// The limit while the octree grows. It is greater than `limit` if pruning follows.
  double growthLimit() const;
  /// Throws `Error` if the base cells take more than the growth limit with `bytes`, or more than the limit with
  /// `leastBytes`, the least that pruning can leave.
  void requireRoomForBaseGrid(double bytes, double leastBytes) const;

  /// Precision of the finished field's coefficients: float where bytes are limited and the choice is free.
  CoefficientType coefficientType() const;

 private:
  const BuildOptions& options_;
  double coefficientBytes_;
  double limit_;
};

/// Throws `Error` for the first setting or domain that is out of range, see `checkBuild`.
void checkOptions(const Box& domain, const BuildOptions& options);

}  // namespace hpsdf::detail
