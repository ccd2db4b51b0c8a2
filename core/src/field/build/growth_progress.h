#pragma once
// Estimates of how far a construction has come, from the decay of its error.

#include <vector>

namespace hpsdf::detail {

/// Extrapolates the decay of the error over the work (evaluations of Φ): they follow a power law, whose exponent is
/// taken from the last decade.
class GrowthProgress {
 public:
  /// Records a state and returns the fraction done, which never falls; 1 once the error is at the target.
  double update(double work, double error, double target);

  /// A lower bound for the final work over the present work: it assumes that from now on the error falls exponentially,
  /// no slower than at present. It is 1 until the error has fallen by a decade, since that is too little to judge by.
  double leastFactor(double work, double error, double target) const;

 private:
  struct Sample {
    double work, error;
  };

  /// The latest sample whose error was more than `factor` times as great; the first one where there is none.
  const Sample& latestAbove(double factor, double error) const;

  std::vector<Sample> history_;
  double fraction_ = 0;
};

}  // namespace hpsdf::detail
