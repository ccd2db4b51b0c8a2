// Tests that default settings miss no small feature of a part.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <tuple>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/detail/exact_samples.h"
#include "hpsdf/exact_distance.h"

namespace hpsdf {
namespace feature_test {

constexpr double kFeature = 1.0 / 300;  ///< width of the features of a plate whose sides are 1 long

/// Makes a plate of 1 × 1 × 0.05 with one feature in each of 15 × 15 tiles: a hole, a slot through the plate, a pin or
/// a rib, at a random place and in a random direction.
class Plate {
 public:
  explicit Plate(unsigned seed) : random_(seed) {
    for (int y = 0; y < kTiles; ++y)
      for (int x = 0; x < kTiles; ++x) addTile(x, y);
    for (int i = 0; i < kTiles; ++i) {
      const auto at = [](int k) { return double(k) / kTiles; };
      addWall({at(i), 0}, {at(i + 1), 0}, 0, kHeight);
      addWall({1, at(i)}, {1, at(i + 1)}, 0, kHeight);
      addWall({at(i + 1), 1}, {at(i), 1}, 0, kHeight);
      addWall({0, at(i + 1)}, {0, at(i)}, 0, kHeight);
    }
  }

  const TriangleMesh& mesh() const { return mesh_; }

 private:
  using Point = std::array<double, 2>;

  static constexpr int kTiles = 15;
  static constexpr double kHeight = 0.05;

  void addTile(int x, int y) {
    const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random_); };
    const double tile = 1.0 / kTiles, low = tile * 0.3, high = tile * 0.7;
    const Point centre = {x * tile + uniform(low, high), y * tile + uniform(low, high)};
    const int kind = std::uniform_int_distribution(0, 3)(random_);
    const bool isLong = kind % 2 == 1, isRaised = kind >= 2;
    const double angle = uniform(-0.7, 0.7), half = kFeature / 2, along = isLong ? 5 * half : half;
    std::array<Point, 4> outer, inner;
    for (int k = 0; k < 4; ++k) {
      const double right = k == 1 || k == 2 ? 1 : 0, up = k >= 2 ? 1 : 0;
      outer[k] = {(x + right) / kTiles, (y + up) / kTiles};
      const double u = (2 * right - 1) * along, v = (2 * up - 1) * half;
      inner[k] = {centre[0] + u * std::cos(angle) - v * std::sin(angle),
                  centre[1] + u * std::sin(angle) + v * std::cos(angle)};
    }
    const double top = isRaised ? kHeight + 2 * kFeature : kHeight;
    for (int k = 0; k < 4; ++k) {
      const int next = (k + 1) % 4;
      addQuad(at(outer[k], kHeight), at(outer[next], kHeight), at(inner[next], kHeight), at(inner[k], kHeight));
      addQuad(at(outer[next], 0), at(outer[k], 0), at(inner[k], 0), at(inner[next], 0));
      if (isRaised)
        addWall(inner[k], inner[next], kHeight, top);
      else
        addWall(inner[next], inner[k], 0, kHeight);
    }
    if (!isRaised) return;
    addQuad(at(inner[0], top), at(inner[1], top), at(inner[2], top), at(inner[3], top));
    addQuad(at(inner[3], 0), at(inner[2], 0), at(inner[1], 0), at(inner[0], 0));
  }

  static Vector3 at(const Point& p, double z) { return {p[0], p[1], z}; }

  /// Adds a wall that faces to the right of the way from `from` to `to`.
  void addWall(const Point& from, const Point& to, double low, double high) {
    addQuad(at(from, low), at(to, low), at(to, high), at(from, high));
  }

  void addQuad(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
    std::array<std::uint32_t, 4> v = {vertex(a), vertex(b), vertex(c), vertex(d)};
    const bool folds = (b - a).cross(c - a).dot((c - a).cross(d - a)) <= 0;  // along the diagonal from a to c
    if (folds) std::rotate(v.begin(), v.begin() + 1, v.end());
    mesh_.triangles.push_back({v[0], v[1], v[2]});
    mesh_.triangles.push_back({v[0], v[2], v[3]});
  }

  std::uint32_t vertex(const Vector3& x) {
    const auto [entry, isNew] = numbers_.try_emplace({x.x(), x.y(), x.z()}, std::uint32_t(mesh_.vertices.size()));
    if (isNew) mesh_.vertices.push_back(x);
    return entry->second;
  }

  std::mt19937_64 random_;
  TriangleMesh mesh_;
  std::map<std::tuple<double, double, double>, std::uint32_t> numbers_;
};

/// Counts the samples whose sign is wrong although they lie deeper than a tenth of a feature.
int wrongSigns(const Field& field, const ExactSamples& samples) {
  std::vector<double> values(samples.points.size());
  field.values(samples.points, values);
  int wrong = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    wrong += std::abs(samples.distances[i]) > kFeature / 10 && values[i] * samples.distances[i] < 0;
  return wrong;
}

TEST(Features, areNotMissedAtDefaultSettings) {
  const Plate plate(5);
  const ExactDistance distance(plate.mesh());
  const Box domain = domainAround(plate.mesh());
  const ExactSamples samples = sampleNear(distance, plate.mesh(), domain, 2 * kFeature, {.count = 300'000});
  EXPECT_EQ(wrongSigns(build(distance, domain), samples), 0);
  BuildOptions paper = paperOptions();
  paper.targetError = BuildOptions().targetError;
  EXPECT_GT(wrongSigns(build(distance, domain, paper), samples), 100) << "the paper's settings miss holes and pins";
}

}  // namespace feature_test
}  // namespace hpsdf
