#pragma once
// The memory that a field will take, and the limit that `BuildOptions` may set to it.

#include <cstddef>

#include "hpsdf/build_options.h"

namespace hpsdf::detail {

/// Counts the bytes of the finished field by its nodes and coefficients, without its lookup grid.
class ByteBudget {
 public:
  explicit ByteBudget(const BuildOptions& options);

  static bool isAskedFor(const BuildOptions& options);

  /// A leaf's degree in the finished field: one higher where leaves are enriched.
  int finalDegree(int degree) const;
  /// Number of coefficients that the finished field keeps of a leaf.
  std::size_t finalCoefficients(int degree) const;
  /// A node's own bytes with its blend extent and bound.
  double nodeBytes() const;
  double leafBytes(int degree) const;
  double bytes(double nodes, double coefficients) const {
    return nodeBytes() * nodes + coefficientBytes_ * coefficients;
  }

  /// The limit for nodes and coefficients; infinite without a limit.
  double limit() const { return limit_; }
  /// The limit while the octree grows: beyond `limit` where pruning follows.
  double growthLimit() const;
  /// Throws `Error` where base cells of these bytes, or of these least bytes after pruning, exceed the limit.
  void requireRoomForBaseGrid(double bytes, double leastBytes) const;

  /// Precision of the finished field's coefficients: float where bytes are limited and the choice is free.
  CoefficientType coefficientType() const;

 private:
  const BuildOptions& options_;
  double coefficientBytes_;
  double limit_;
};

}  // namespace hpsdf::detail
