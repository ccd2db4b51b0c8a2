// Makes a field larger than the memory that is allowed, and takes the times of queries and pictures of it, resident or
// mapped. `bench/mapped` calls it.
//
//   hpsdf_mapped_field make FIELD.hpsdf
//   hpsdf_mapped_field time FIELD.hpsdf resident|mapped

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hpsdf/hpsdf.h"
#include "hpsdf/render/renderer.h"
#include "hpsdf/render/view.h"

namespace {

using hpsdf::Field;
using hpsdf::FieldData;
using hpsdf::Vector3;
using Json = nlohmann::ordered_json;
using Seconds = std::chrono::duration<double>;

constexpr int kDegree = 10;
constexpr std::uint32_t kBaseCells = 5;  // along each axis
constexpr int kDepth = 5;                // of all leaves
constexpr int kBlockDepth = 1;           // of the nodes whose leaves are built together
constexpr double kNear = 0.02;           // greatest distance of the queried points from the surface
constexpr int kCalls = 20;
constexpr int kWidth = 960, kHeight = 540;

hpsdf::DistanceFunction torus() { return hpsdf::shapes::analytic("analytic:torus"); }

/// Builds a field whose leaves all have the same depth and mostly the same degree, block by block.
class LargeField {
 public:
  LargeField() {
    data_.domain = hpsdf::domainAround(torus_.source().box);
    data_.grid = {kBaseCells, kBaseCells, kBaseCells};
    data_.nodes.resize(std::size_t{kBaseCells} * kBaseCells * kBaseCells);
  }

  Field build() {
    for (std::uint32_t z = 0; z < kBaseCells; ++z)
      for (std::uint32_t y = 0; y < kBaseCells; ++y)
        for (std::uint32_t x = 0; x < kBaseCells; ++x) add((z * kBaseCells + y) * kBaseCells + x, {x, y, z}, 0);
    data_.metadata.source = torus_.source();
    data_.coefficients = hpsdf::FieldArray<double>(std::move(coefficients_));
    return Field(std::move(data_));
  }

 private:
  using Place = std::array<std::uint32_t, 3>;  // of a node among those of its depth

  void add(std::size_t node, const Place& place, int depth) {
    if (depth == kBlockDepth) block_ = buildBlock(place);
    if (depth == kDepth) {
      data_.nodes[node] = leaf(place);
      return;
    }
    const std::size_t first = data_.nodes.size();
    data_.nodes[node] = hpsdf::node::internal(static_cast<std::uint32_t>(first));
    data_.nodes.resize(first + 8);
    for (std::uint32_t child = 0; child < 8; ++child)
      add(first + child, {2 * place[0] + (child & 1), 2 * place[1] + (child >> 1 & 1), 2 * place[2] + (child >> 2)},
          depth + 1);
  }

  FieldData buildBlock(const Place& place) const {
    const Vector3 edge = data_.domain.sizes().matrix() / (kBaseCells << kBlockDepth);
    const Vector3 corner = data_.domain.min() + Vector3(place[0], place[1], place[2]).cwiseProduct(edge);
    return hpsdf::build(torus_, {corner, corner + edge},
                        {.targetError = 1e-200,
                         .grid = {kCells, kCells, kCells},
                         .estimator = hpsdf::Estimator::embedded,
                         .maxDegree = kDegree,
                         .maxDepth = 0,
                         .strategy = hpsdf::Strategy::hp,
                         .coefficients = hpsdf::CoefficientType::float64})
        .data();
  }

  std::uint64_t leaf(const Place& place) {
    const std::size_t cell = (std::size_t(place[2] % kCells) * kCells + place[1] % kCells) * kCells + place[0] % kCells;
    const std::uint64_t bits = block_.nodes[cell];
    const int degree = hpsdf::node::degree(bits);
    const auto offset = static_cast<std::uint32_t>(coefficients_.size());
    hpsdf::withCoefficients(block_, bits, [&](const auto* c) {
      coefficients_.insert(coefficients_.end(), c, c + hpsdf::coefficientCount(degree));
    });
    return hpsdf::node::leaf(degree, offset);
  }

  static constexpr std::uint32_t kCells = 1U << (kDepth - kBlockDepth);  // of a block, along each axis

  hpsdf::DistanceFunction torus_ = torus();
  FieldData data_, block_;
  std::vector<double> coefficients_;
};

std::vector<Vector3> pointsNearSurface(const hpsdf::Box& domain, std::size_t count) {
  const hpsdf::DistanceFunction distance = torus();
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform;
  std::vector<Vector3> points;
  while (points.size() < count) {
    const Vector3 at(uniform(random), uniform(random), uniform(random));
    const Vector3 point = domain.min() + at.cwiseProduct(domain.sizes().matrix());
    double value = 0;
    distance({&point, 1}, {&value, 1});
    if (std::abs(value) < kNear) points.push_back(point);
  }
  return points;
}

/// Takes the time of a first call and the least time of `kCalls` further ones. All calls must give the same numbers, of
/// which a hash is told.
template <typename Work>
Json timed(const Work& work) {
  const auto once = [&] {
    const auto start = std::chrono::steady_clock::now();
    const auto numbers = work();
    const double seconds = Seconds(std::chrono::steady_clock::now() - start).count();
    const std::string_view bytes(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof numbers[0]);
    return std::pair(seconds, std::hash<std::string_view>()(bytes));
  };
  const auto [first, hash] = once();
  double least = std::numeric_limits<double>::infinity();
  for (int run = 0; run < kCalls; ++run) {
    const auto [seconds, again] = once();
    if (again != hash) throw hpsdf::Error("a repeated call gave other numbers");
    least = std::min(least, seconds);
  }
  return {{"first", first}, {"warm", least}, {"hash", hash}};
}

/// Returns the memory of the process without that of the pages of files, in bytes.
std::size_t ownMemory() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == "RssAnon:") {
      std::size_t kilobytes = 0;
      status >> kilobytes;
      return kilobytes * 1024;
    }
  return 0;
}

Json times(const std::filesystem::path& file, hpsdf::Loading loading) {
  const auto start = std::chrono::steady_clock::now();
  const Field field = hpsdf::load(file, loading);
  Json result{{"load", Seconds(std::chrono::steady_clock::now() - start).count()}};
  const std::vector<Vector3> points = pointsNearSurface(field.domain(), 300'000);
  std::vector<double> values(points.size());
  result["batch"] = timed([&] {
    field.values(points, values);
    return values;
  });
  result["single points"] = timed([&] {
    std::ranges::transform(points, values.begin(), [&](const Vector3& point) { return field.value(point); });
    return values;
  });
  const auto renderer = hpsdf::render::makeCpuRenderer(field);
  const auto slice = hpsdf::render::axisSlice(field.domain(), 2, 0.1, kWidth, kHeight);
  result["slice"] = timed([&] { return renderer->slice(slice, kWidth, kHeight).value; });
  const hpsdf::render::SurfaceView view{.camera = hpsdf::render::cameraOf({}, field.domain(), kWidth, kHeight)};
  result["surface"] = timed([&] { return renderer->surface(view, kWidth, kHeight).distance; });
  result["own memory"] = ownMemory();
  return result;
}

}  // namespace

int main(int count, char** words) {
  const std::vector<std::string> arguments(words + 1, words + count);
  try {
    if (arguments.size() == 2 && arguments[0] == "make") {
      hpsdf::save(LargeField().build(), arguments[1]);
      return 0;
    }
    if (arguments.size() == 3 && arguments[0] == "time") {
      const auto loading = arguments[2] == "mapped" ? hpsdf::Loading::mapped : hpsdf::Loading::resident;
      std::cout << times(arguments[1], loading) << "\n";
      return 0;
    }
  } catch (const std::exception& error) {
    std::cerr << "hpsdf_mapped_field: " << error.what() << "\n";
    return 2;
  }
  std::cerr << "usage: hpsdf_mapped_field make FIELD.hpsdf\n"
               "       hpsdf_mapped_field time FIELD.hpsdf resident|mapped\n";
  return 2;
}
