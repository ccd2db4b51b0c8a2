#include "sphere_minima.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace hpsdf::physics {
namespace {

constexpr std::size_t kDirections = 128;  // number of points at which a search samples the sphere
constexpr std::size_t kStarts = 24;       // greatest number of points from which a descent starts
constexpr int kRounds = 4;                // steps of each descent
// Two directions count as the same if the cosine of the angle between them exceeds these limits:
// `kSameStart` before the descents, `kSameMinimum` after the descents.
constexpr double kSameStart = 0.93, kSameMinimum = 0.97;

/// Directions along a spiral that cover the sphere evenly: every direction is within about 0.2 radians of one of them.
const std::array<Vector3, kDirections>& directionsAllAround() {
  static const std::array<Vector3, kDirections> directions = [] {
    std::array<Vector3, kDirections> made;
    const double turn = std::numbers::pi * (3 - std::sqrt(5.0));
    for (std::size_t i = 0; i < kDirections; ++i) {
      const double z = 1 - (2 * double(i) + 1) / kDirections, r = std::sqrt(1 - z * z);
      made[i] = {r * std::cos(turn * double(i)), r * std::sin(turn * double(i)), z};
    }
    return made;
  }();
  return directions;
}

/// Evaluates the field at the points of the sphere in the directions of `minima`, and sets their values.
void evaluateValues(const Field& field, const Vector3& center, double radius, std::span<SphereMinimum> minima) {
  std::array<Vector3, kDirections + SphereMinima::kMost> points;
  std::array<double, points.size()> values;
  for (std::size_t i = 0; i < minima.size(); ++i) points[i] = center + radius * minima[i].direction;
  field.values({points.data(), minima.size()}, {values.data(), minima.size()});
  for (std::size_t i = 0; i < minima.size(); ++i) minima[i].value = values[i];
}

/// Evaluates the field and its slope along the sphere at the points in the directions of `minima`.
void evaluateSlopes(const Field& field, const Vector3& center, double radius, std::span<SphereMinimum> minima) {
  std::array<Vector3, kStarts> points;
  std::array<ValueAndGradient, kStarts> answers;
  for (std::size_t i = 0; i < minima.size(); ++i) points[i] = center + radius * minima[i].direction;
  field.valuesAndGradients({points.data(), minima.size()}, {answers.data(), minima.size()});
  for (std::size_t i = 0; i < minima.size(); ++i) {
    const Vector3& gradient = answers[i].gradient;
    minima[i].value = answers[i].value;
    minima[i].slope = gradient - gradient.dot(minima[i].direction) * minima[i].direction;
  }
}

/// Sorts the minima by value. Keeps only the lowest one of several minima with nearly the same direction, and at
/// most `most` minima.
void keepLowest(std::size_t most, double sameCosine, std::vector<SphereMinimum>& minima) {
  std::ranges::sort(minima, {}, &SphereMinimum::value);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < minima.size() && kept < most; ++i)
    if (std::none_of(minima.begin(), minima.begin() + std::ptrdiff_t(kept), [&](const SphereMinimum& minimum) {
          return minimum.direction.dot(minima[i].direction) > sameCosine;
        }))
      minima[kept++] = minima[i];
  minima.resize(kept);
}

/// Moves each point by one step of gradient descent over the sphere. Sets the length of the next step by
/// the method of Barzilai and Borwein (1988).
void descend(const Field& field, const Vector3& center, double radius, std::span<SphereMinimum> minima) {
  std::array<SphereMinimum, kStarts> tried;
  const std::span<SphereMinimum> next{tried.data(), minima.size()};
  for (std::size_t i = 0; i < minima.size(); ++i)
    next[i].direction = (minima[i].direction - minima[i].step * minima[i].slope).normalized();
  evaluateSlopes(field, center, radius, next);
  for (std::size_t i = 0; i < minima.size(); ++i) {
    const double before = minima[i].slope.squaredNorm(), change = before - minima[i].slope.dot(next[i].slope);
    const double step = minima[i].step * (change > 0 ? std::clamp(before / change, 0.1, 3.0) : 3.0);
    if (next[i].value < minima[i].value) minima[i] = next[i];
    minima[i].step = step;
  }
}

}  // namespace

std::span<const SphereMinimum> SphereMinima::find(const Field& field, const Vector3& center, double radius,
                                                  double margin) {
  for (SphereMinimum& minimum : minima_) minimum.step = 1;
  for (const Vector3& direction : directionsAllAround()) minima_.push_back({direction});
  evaluateValues(field, center, radius, minima_);
  // Keep points whose value is at most 0.2 radii above the margin, because the field may be lower between the
  // sampled directions.
  std::erase_if(minima_, [&](const SphereMinimum& minimum) { return !(minimum.value <= margin + 0.2 * radius); });
  keepLowest(kStarts, kSameStart, minima_);
  evaluateSlopes(field, center, radius, minima_);
  for (int round = 0; round < kRounds; ++round) descend(field, center, radius, minima_);
  std::erase_if(minima_, [&](const SphereMinimum& minimum) { return !(minimum.value <= margin); });
  keepLowest(kMost, kSameMinimum, minima_);
  return minima_;
}

}  // namespace hpsdf::physics
