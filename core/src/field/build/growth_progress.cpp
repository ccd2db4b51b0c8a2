#include "field/build/growth_progress.h"

#include <algorithm>
#include <cmath>

namespace hpsdf::detail {

const GrowthProgress::Sample& GrowthProgress::latestAbove(double factor, double error) const {
  const Sample* latest = &history_.front();
  for (const Sample& sample : history_)
    if (sample.error > factor * error) latest = &sample;
  return *latest;
}

double GrowthProgress::update(double work, double error, double target) {
  if (error <= target) return 1;
  if (history_.empty() || error < 0.8 * history_.back().error) history_.push_back({work, error});
  const Sample& past = latestAbove(10, error);
  double exponent = 0.7;  // typical of scanned meshes, as long as nothing can be measured
  if (past.error > 2 * error && work > past.work) exponent = std::log(work / past.work) / std::log(past.error / error);
  fraction_ = std::max(fraction_, std::min(0.99, std::pow(target / error, exponent)));
  return fraction_;
}

double GrowthProgress::leastFactor(double work, double error, double target) const {
  if (history_.empty() || !(history_.front().error > 10 * error) || !(error > target)) return 1;
  const Sample& past = latestAbove(3, error);
  if (!(work > past.work)) return 1;
  return 1 + std::log(error / target) * std::log(work / past.work) / std::log(past.error / error);
}

}  // namespace hpsdf::detail
