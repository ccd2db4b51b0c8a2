// Fields that several processes build together equal those of one process, byte for byte; sums without rounding; parts
// of octrees.

#include "hpsdf/parallel/ranks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "field/shares/tree_parts.h"
#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/shapes.h"
#include "support/temporary_directory.h"
#include "support/thread_ranks.h"
#include "support/ways_to_build.h"
#include "util/exact_sum.h"

namespace hpsdf {
namespace ranks_test {

namespace fs = std::filesystem;
using detail::ExactSum;
using detail::MortonPlace;
using support::cube;
using support::runRanks;
using support::spheres;

std::string bytesOf(const Field& field) {
  const support::TemporaryDirectory folder;
  save(field, folder / "field");
  std::ifstream stream(folder / "field", std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string messageOf(const std::exception_ptr& thrown) {
  if (!thrown) return "";
  try {
    std::rethrow_exception(thrown);
  } catch (const std::exception& error) {
    return error.what();
  }
}

/// Returns the bytes of the field that ranks build together, which rank 0 alone must return.
std::string bytesByRanks(int count, const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                         const Checkpoint* checkpoint = nullptr) {
  std::string bytes;
  const auto thrown = runRanks(count, [&](Ranks& ranks) {
    const std::optional<Field> field = buildByRanks(ranks, distance, domain, options, checkpoint);
    EXPECT_EQ(field.has_value(), ranks.rank() == 0);
    if (field) bytes = bytesOf(*field);
  });
  for (const std::exception_ptr& error : thrown) EXPECT_EQ(messageOf(error), "");
  return bytes;
}

void expectTheSameBytes(const DistanceFunction& distance, const Box& domain, const std::vector<BuildOptions>& ways,
                        const std::vector<int>& counts) {
  int path = 0;
  for (BuildOptions options : ways) {
    SCOPED_TRACE("way " + std::to_string(path++));
    if (options.maxBytes) continue;
    options.threads = 1;
    const std::string alone = bytesOf(build(distance, domain, options));
    for (const int count : counts) EXPECT_TRUE(bytesByRanks(count, distance, domain, options) == alone) << count;
  }
}

TEST(Ranks, BuildTheSameBytesInEveryWay) { expectTheSameBytes(spheres, cube(), support::everyWay(), {1, 2, 3, 8}); }

TEST(Ranks, BuildTheSameExactLeaves) {
  const TriangleMesh mesh = shapes::mesh("box");
  expectTheSameBytes(ExactDistance(mesh), domainAround(boundingBox(mesh)), support::everyWayToExactLeaves(), {3});
}

TEST(Ranks, BuildTheSameBytesFromAMesh) {
  const TriangleMesh mesh = shapes::mesh("structured-bowl,cells=12,bumps=3");
  expectTheSameBytes(ExactDistance(mesh), domainAround(boundingBox(mesh)),
                     {{.targetError = 1e-5}, {.targetError = 1e-5, .criterion = Criterion::optimal}}, {2, 5});
}

/// Passes calls on to ranks, and records the bytes that each exchange has sent.
class RecordedRanks : public Ranks {
 public:
  explicit RecordedRanks(Ranks& ranks) : ranks_(ranks) {}
  int rank() const override { return ranks_.rank(); }
  int count() const override { return ranks_.count(); }
  std::vector<Message> gatherAll(std::span<const std::byte> own, const std::function<void()>& whileWaiting) override {
    return ranks_.gatherAll(own, whileWaiting);
  }
  std::vector<Message> exchange(std::vector<Message> toEach) override {
    sent_.push_back(0);
    for (const Message& message : toEach) sent_.back() += message.size();
    return ranks_.exchange(std::move(toEach));
  }
  /// Returns the bytes of the last exchanges.
  std::size_t sentAtLast(int exchanges) const {
    return std::accumulate(sent_.end() - exchanges, sent_.end(), std::size_t{0});
  }

 private:
  Ranks& ranks_;
  std::vector<std::size_t> sent_;
};

TEST(Ranks, HoldPartsOfTheFieldOfAboutEqualSize) {
  const BuildOptions options{.targetError = 1e-7, .coefficients = CoefficientType::float64, .threads = 1};
  std::array<std::size_t, 4> sent{};  // each rank but the first sends its part in the end
  runRanks(4, [&](Ranks& ranks) {
    RecordedRanks recorded(ranks);
    buildByRanks(recorded, spheres, cube(), options);
    sent[std::size_t(ranks.rank())] = recorded.sentAtLast(ranks.count());  // nodes, then each part's coefficients
  });
  const auto all = double(build(spheres, cube(), options).bytes());
  EXPECT_EQ(sent[0], 0u);
  for (const std::size_t part : std::span(sent).subspan(1)) {
    EXPECT_GT(double(part), 0.12 * all);
    EXPECT_LT(double(part), 0.4 * all);
  }
}

/// Stops a construction of `count` ranks after some evaluations in one of them.
void stopAfter(std::int64_t evaluations, int count, const BuildOptions& options, const Checkpoint& checkpoint) {
  std::atomic<std::int64_t> left = evaluations;
  const auto thrown = runRanks(count, [&](Ranks& ranks) {
    const bool isLast = ranks.rank() == count - 1;
    const Progress progress{.report = {}, .cancelled = [&, isLast] { return isLast && left < 0; }};
    const DistanceFunction counted([&](std::span<const Vector3> points, std::span<double> out) {
      left -= std::int64_t(points.size());
      for (std::size_t i = 0; i < points.size(); ++i) out[i] = spheres(points[i]);
    });
    buildByRanks(ranks, counted, cube(), options, &checkpoint, progress);
  });
  for (const std::exception_ptr& error : thrown) EXPECT_EQ(messageOf(error), "cancelled");
}

TEST(Ranks, ContinueFromACheckpointOfAnotherNumberOfRanks) {
  const support::TemporaryDirectory folder;
  std::mt19937_64 random(3);
  for (BuildOptions options : {BuildOptions{.targetError = 1e-7, .threads = 1},
                               BuildOptions{.targetError = 1e-6, .criterion = Criterion::optimal, .threads = 1},
                               BuildOptions{.targetError = NearFarError{3e-4, 3e-4}, .threads = 1}}) {
    const DistanceFunction distance(spheres);
    const Field whole = build(distance, cube(), options);
    const auto all = std::int64_t(whole.metadata().exactEvaluations);
    std::uint64_t resumedAt = 0;
    Checkpoint checkpoint{.file = folder / "state", .seconds = 0, .share = 1};
    checkpoint.resumed = [&](std::uint64_t steps) { resumedAt = steps; };
    for (const int count : {3, 2, 5}) stopAfter(all / 4, count, options, checkpoint);
    EXPECT_GT(resumedAt, 0u);
    ASSERT_TRUE(fs::exists(checkpoint.file));
    const fs::path copy = folder / "copy";
    fs::copy_file(checkpoint.file, copy, fs::copy_options::overwrite_existing);
    EXPECT_TRUE(bytesByRanks(4, distance, cube(), options, &checkpoint) == bytesOf(whole));
    // One process continues from a state of several, too.
    EXPECT_TRUE(bytesOf(buildResumably(distance, cube(), options, {.file = copy})) == bytesOf(whole));
    fs::remove(checkpoint.file);
    fs::remove(copy);
  }
}

TEST(Ranks, AllEndIfOneFails) {
  const BuildOptions options{.targetError = 1e-8, .threads = 1};
  const auto thrown = runRanks(3, [&](Ranks& ranks) {
    const bool fails = ranks.rank() == 1;
    std::atomic<int> calls = 0;
    const auto distance = [&, fails](const Vector3& x) {
      return fails && ++calls > 2000 ? std::numeric_limits<double>::quiet_NaN() : spheres(x);
    };
    buildByRanks(ranks, distance, cube(), options);
  });
  for (const std::exception_ptr& error : thrown)
    EXPECT_THAT(messageOf(error), testing::HasSubstr("the signed distance is not finite"));
}

TEST(Ranks, RefuseWhatOneProcessMustDo) {
  for (const auto& [options, why] :
       {std::pair(BuildOptions{.targetError = 0, .tolerance = 0.01},
                  "cannot build a field within a tolerance: leave out the tolerance, or start one process"),
        std::pair(BuildOptions{.maxBytes = 100000}, "cannot build a field within a limit of bytes")}) {
    const auto thrown =
        runRanks(2, [&, &options = options](Ranks& ranks) { buildByRanks(ranks, spheres, cube(), options); });
    for (const std::exception_ptr& error : thrown) EXPECT_THAT(messageOf(error), testing::HasSubstr(why));
  }
}

TEST(Ranks, RefuseDifferentInputs) {
  for (const bool haveOtherDomains : {false, true}) {
    const auto thrown = runRanks(3, [&](Ranks& ranks) {
      const bool isOther = ranks.rank() == 2;
      const Box domain(cube().min(), haveOtherDomains && isOther ? Vector3(2 * cube().max()) : cube().max());
      buildByRanks(ranks, spheres, domain, {.targetError = !haveOtherDomains && isOther ? 1e-4 : 1e-5, .threads = 1});
    });
    for (const std::exception_ptr& error : thrown)
      EXPECT_THAT(messageOf(error), testing::HasSubstr("different surfaces, domains or options"));
  }
}

TEST(ExactSums, DependOnlyOnTheSummands) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> mantissa(-1, 1);
  std::uniform_int_distribution<int> exponent(-300, 300);
  std::vector<double> numbers(2000);
  for (double& number : numbers) number = std::ldexp(mantissa(random), exponent(random));
  ExactSum forward, shuffled, part;
  for (const double number : numbers) forward.add(number);
  std::ranges::shuffle(numbers, random);
  for (std::size_t i = 0; i < numbers.size(); ++i) (i % 3 == 0 ? part : shuffled).add(numbers[i]);
  shuffled.add(ExactSum::fromNumbers(part.numbers()));
  EXPECT_EQ(forward.value(), shuffled.value());
  for (const double number : numbers) forward.add(number, -1);
  EXPECT_EQ(forward.value(), 0);
}

TEST(ExactSums, AreExact) {
  ExactSum sum;
  for (const double number : {1.0, 1e100, 1e-300, 0x1p-1074, -1e100, -1e-300, -1.0}) sum.add(number);
  EXPECT_EQ(sum.value(), 0x1p-1074);
  sum.add(0x1p-1074, -3);
  EXPECT_EQ(sum.value(), -0x1p-1073);
  std::mt19937_64 random(5);
  for (int i = 0; i < 1000; ++i) {  // integers that doubles add without rounding
    ExactSum integers;
    std::int64_t expected = 0;
    for (int k = 0; k < 50; ++k) {
      const auto number = std::int64_t(random() >> 20) - (std::int64_t{1} << 43);
      expected += number;
      integers.add(double(number));
    }
    ASSERT_EQ(integers.value(), double(expected));
  }
  sum.add(std::numeric_limits<double>::max());
  EXPECT_EQ(sum.value(), std::numeric_limits<double>::max());
  sum.add(std::numeric_limits<double>::max());
  EXPECT_TRUE(std::isinf(sum.value()));

  ExactSum special;
  special.add(1);
  special.add(-HUGE_VAL);
  EXPECT_EQ(special.value(), -HUGE_VAL);
  special.add(HUGE_VAL);
  EXPECT_TRUE(std::isnan(special.value()));
  special.add(HUGE_VAL, -1);
  special.add(-HUGE_VAL, -1);
  EXPECT_EQ(special.value(), 1);
}

TEST(MortonOrder, KeepsCellsTogether) {
  // The cells of one parent are successive, and so are those of each of its ancestors.
  std::vector<MortonPlace> places;
  for (std::uint32_t z = 0; z < 8; ++z)
    for (std::uint32_t y = 0; y < 8; ++y)
      for (std::uint32_t x = 0; x < 8; ++x) places.push_back(detail::mortonPlaceOf({3, {x, y, z}}, 10));
  std::sort(places.begin(), places.end());
  for (std::uint32_t level = 1; level <= 3; ++level) {
    const std::size_t size = std::size_t{1} << (3 * level);
    for (std::size_t i = 0; i < places.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        ASSERT_EQ(places[i].corner[axis] >> (7 + level), places[i / size * size].corner[axis] >> (7 + level));
  }
  EXPECT_EQ(places.front(), detail::mortonPlaceOf({0, {0, 0, 0}}, 10));
}

}  // namespace ranks_test
}  // namespace hpsdf
