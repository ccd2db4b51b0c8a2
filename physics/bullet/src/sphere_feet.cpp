#include "sphere_feet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace hpsdf::physics {
namespace {

constexpr std::size_t kDirections = 128, kStarts = 24;
constexpr int kRounds = 4;
constexpr double kApart = 0.93, kSame = 0.97;  // cosines between directions

/// Evenly spread, along a spiral: no direction is farther than some 0.2 radians from one of them.
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

void takeValues(const Field& field, const Vector3& center, double radius, std::span<Foot> feet) {
  std::array<Vector3, kDirections + SphereFeet::kMost> points;
  std::array<double, points.size()> values;
  for (std::size_t i = 0; i < feet.size(); ++i) points[i] = center + radius * feet[i].direction;
  field.values({points.data(), feet.size()}, {values.data(), feet.size()});
  for (std::size_t i = 0; i < feet.size(); ++i) feet[i].value = values[i];
}

void takeSlopes(const Field& field, const Vector3& center, double radius, std::span<Foot> feet) {
  std::array<Vector3, kStarts> points;
  std::array<ValueAndGradient, kStarts> answers;
  for (std::size_t i = 0; i < feet.size(); ++i) points[i] = center + radius * feet[i].direction;
  field.valuesAndGradients({points.data(), feet.size()}, {answers.data(), feet.size()});
  for (std::size_t i = 0; i < feet.size(); ++i) {
    const Vector3& gradient = answers[i].gradient;
    feet[i].value = answers[i].value;
    feet[i].slope = gradient - gradient.dot(feet[i].direction) * feet[i].direction;
  }
}

/// The lowest first, and of those that are near each other the lowest alone.
void keepLowest(std::size_t most, double apart, std::vector<Foot>& feet) {
  std::ranges::sort(feet, {}, &Foot::value);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < feet.size() && kept < most; ++i)
    if (std::none_of(feet.begin(), feet.begin() + std::ptrdiff_t(kept),
                     [&](const Foot& foot) { return foot.direction.dot(feet[i].direction) > apart; }))
      feet[kept++] = feet[i];
  feet.resize(kept);
}

/// A step of each against its slope (Barzilai and Borwein 1988): on flat ground it ends where the sphere is deepest.
void descend(const Field& field, const Vector3& center, double radius, std::span<Foot> feet) {
  std::array<Foot, kStarts> tried;
  const std::span<Foot> next{tried.data(), feet.size()};
  for (std::size_t i = 0; i < feet.size(); ++i)
    next[i].direction = (feet[i].direction - feet[i].reach * feet[i].slope).normalized();
  takeSlopes(field, center, radius, next);
  for (std::size_t i = 0; i < feet.size(); ++i) {
    const double before = feet[i].slope.squaredNorm(), change = before - feet[i].slope.dot(next[i].slope);
    const double reach = feet[i].reach * (change > 0 ? std::clamp(before / change, 0.1, 3.0) : 3.0);
    if (next[i].value < feet[i].value) feet[i] = next[i];
    feet[i].reach = reach;
  }
}

}  // namespace

std::span<const Foot> SphereFeet::find(const Field& field, const Vector3& center, double radius, double margin) {
  for (Foot& foot : feet_) foot.reach = 1;
  for (const Vector3& direction : directionsAllAround()) feet_.push_back({direction});
  takeValues(field, center, radius, feet_);
  // the surface may rise between directions
  std::erase_if(feet_, [&](const Foot& foot) { return !(foot.value <= margin + 0.2 * radius); });
  keepLowest(kStarts, kApart, feet_);
  takeSlopes(field, center, radius, feet_);
  for (int round = 0; round < kRounds; ++round) descend(field, center, radius, feet_);
  std::erase_if(feet_, [&](const Foot& foot) { return !(foot.value <= margin); });
  keepLowest(kMost, kSame, feet_);
  return feet_;
}

}  // namespace hpsdf::physics
