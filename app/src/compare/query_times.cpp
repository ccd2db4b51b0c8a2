#include <algorithm>
#include <chrono>
#include <limits>

#include "compare/comparison.h"
#include "console/long_work.h"
#include "hpsdf/detail/random_points.h"

namespace hpsdf::app {
namespace {

constexpr std::size_t kTimedPoints = 20'000;
constexpr int kTimedRounds = 15;

/// Returns the seconds that work() takes, or `least` if that is less.
template <typename Work>
double fastest(double least, const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::min(least, secondsSince(start));
}

}  // namespace

std::vector<QueryTimes> queryTimes(const std::vector<CurrentField>& fields, const Box& domain, std::uint64_t seed,
                                   const Progress& progress) {
  std::vector<Vector3> points;
  for (std::size_t n = 0; n < kTimedPoints; ++n) points.push_back(detail::Random(seed, n).inBox(domain));
  std::vector<double> values(points.size());
  constexpr double kNever = std::numeric_limits<double>::infinity();
  std::vector<QueryTimes> times(fields.size(), {kNever, kNever});
  for (int round = 0; round < kTimedRounds; ++round)
    for (std::size_t n = 0; n < fields.size(); ++n) {
      progress.update("timing queries", double(round) / kTimedRounds);
      const Field& field = fields[n].field;
      times[n].single = fastest(times[n].single, [&] {
        for (std::size_t k = 0; k < points.size(); ++k) values[k] = field.value(points[k]);
      });
      times[n].batched = fastest(times[n].batched, [&] { field.values(points, values); });
    }
  for (QueryTimes& time : times) {
    time.single /= double(kTimedPoints);
    time.batched /= double(kTimedPoints);
  }
  return times;
}

}  // namespace hpsdf::app
