// Tests fields whose coefficients stay in a mapped file.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "field/io/blocked_file.h"
#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/jumps.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/shapes.h"
#include "hpsdf/verify.h"
#include "support/file_checksums.h"
#include "support/message_of.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace mapped_field_test {

using support::messageOf;

constexpr std::size_t kBlock = 65536;

std::string readAll(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void writeAll(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

/// Returns a field whose coefficients take several blocks.
Field torusField(CoefficientType type, double blend = 0) {
  const DistanceFunction torus = shapes::analytic("analytic:torus");
  return build(torus, domainAround(torus.source().box),
               {.targetError = 1e-8, .grid = {2, 2, 2}, .blend = blend, .coefficients = type});
}

std::vector<Vector3> randomPoints(const Box& domain, int count) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-0.1, 1.1);
  std::vector<Vector3> points;
  for (int n = 0; n < count; ++n)
    points.push_back(domain.min() +
                     Vector3(uniform(random), uniform(random), uniform(random)).cwiseProduct(domain.sizes().matrix()));
  return points;
}

class Mapped : public testing::Test {
 protected:
  std::filesystem::path file() const { return folder_.path() / "field.hpsdf"; }

  support::TemporaryDirectory folder_;
};

TEST_F(Mapped, answersAsTheFieldInMemory) {
  for (const auto type : {CoefficientType::float64, CoefficientType::float32, CoefficientType::quantized})
    for (const double blend : {0.0, 0.1}) {
      const Field field = torusField(type, blend);
      ASSERT_GT(coefficientBytes(field.data()), 2 * kBlock);
      save(field, file());
      const Field mapped = load(file(), Loading::mapped);
      ASSERT_TRUE(mapped.isMapped());
      ASSERT_FALSE(field.isMapped());
      EXPECT_EQ(mapped.data().nodes, field.data().nodes);
      const std::vector<Vector3> points = randomPoints(field.domain(), 2000);
      std::vector<ValueAndGradient> expected(points.size()), found(points.size());
      field.valuesAndGradients(points, expected);
      mapped.valuesAndGradients(points, found);
      for (std::size_t n = 0; n < points.size(); ++n) {
        EXPECT_EQ(found[n].value, expected[n].value);
        EXPECT_EQ(found[n].gradient, expected[n].gradient);
        EXPECT_EQ(mapped.value(points[n]), expected[n].value);
        EXPECT_EQ(mapped.valueGradientHessian(points[n]).hessian, field.valueGradientHessian(points[n]).hessian);
      }
      EXPECT_EQ(mapped.data().coefficients, field.data().coefficients);
    }
}

/// Fields are changed, copied and saved like those in memory, also to the file in which they are.
TEST_F(Mapped, isChangedAndSavedAsTheFieldInMemory) {
  for (const auto type : {CoefficientType::float64, CoefficientType::quantized}) {
    const Field field = torusField(type);
    save(field, file());
    const std::string bytes = readAll(file());
    const Field mapped = load(file(), Loading::mapped);
    EXPECT_EQ(weaklyContinuous(mapped, {}).field.data().coefficients,
              weaklyContinuous(field, {}).field.data().coefficients);
    EXPECT_EQ(findJumps(mapped).value.rms, findJumps(field).value.rms);
    const Field copy = blended(mapped, 0.1);
    EXPECT_TRUE(copy.isMapped()) << "copies refer to the same file";
    save(mapped, file());
    EXPECT_TRUE(readAll(file()) == bytes);
    save(mapped, file(), {.compress = true});
    EXPECT_FALSE(canBeMapped(file()));
    EXPECT_EQ(load(file()).data().coefficients, copy.data().coefficients) << "the file that is mapped is still there";
    FieldData data = mapped.data();
    std::visit([](auto& c) { ++arrayOf(c).values()[0]; }, data.coefficients);
    EXPECT_NE(data.coefficients, field.data().coefficients);
    EXPECT_EQ(mapped.data().coefficients, field.data().coefficients) << "a copy is changed, not the file";
  }
}

/// Returns the centre of the leaf that holds the given number of the array of coefficients.
Vector3 centreOfLeafAt(const Field& field, std::size_t number) {
  std::optional<Vector3> centre;
  field.forEachCell([&](const Cell& cell) {
    const std::uint64_t bits = field.data().nodes[cell.id];
    if (node::offset(bits) <= number && number < std::size_t(node::offset(bits)) + coefficientCount(node::degree(bits)))
      centre = cell.box.center();
  });
  return centre.value();
}

/// Damage is found where it is read, by all that reads it, and only there.
TEST_F(Mapped, damageIsFoundWhereItIsRead) {
  const Field field = torusField(CoefficientType::float64);
  save(field, file());
  const std::string whole = readAll(file());
  const std::size_t count = std::get<FieldArray<double>>(field.data().coefficients).size();
  const std::string stored(
      reinterpret_cast<const char*>(std::get<FieldArray<double>>(field.data().coefficients).data()),
      count * sizeof(double));
  const std::size_t start = whole.find(stored);
  ASSERT_NE(start, std::string::npos);
  ASSERT_GT(stored.size(), 3 * kBlock);
  std::string damaged = whole;
  damaged[start + count / 2 * sizeof(double)] ^= 1;
  writeAll(file(), damaged);
  EXPECT_NE(messageOf([&] { load(file()); }).find("is wrong"), std::string::npos);

  const Vector3 far = centreOfLeafAt(field, 0), near = centreOfLeafAt(field, count / 2);
  const auto expectFound = [&](const auto& ask) {
    const Field mapped = load(file(), Loading::mapped);
    EXPECT_EQ(mapped.value(far), field.value(far)) << "other blocks are whole";
    for (int n = 0; n < 2; ++n) {
      const std::string message = messageOf([&] { ask(mapped); });
      EXPECT_TRUE(message.starts_with(file().string() + ": the field file is damaged: its checksum of the block at"))
          << message;
    }
  };
  const std::vector<Vector3> points = randomPoints(field.domain(), 20000);
  std::vector<double> values(points.size());
  std::vector<ValueAndGradient> answers(points.size());
  expectFound([&](const Field& mapped) { mapped.value(near); });
  expectFound([&](const Field& mapped) { mapped.valueAndGradient(near); });
  expectFound([&](const Field& mapped) { mapped.valueGradientHessian(near); });
  expectFound([&](const Field& mapped) { mapped.cellAt(near); });
  expectFound([&](const Field& mapped) { mapped.values(std::vector<Vector3>(3, near), std::span(values).first(3)); });
  expectFound([&](const Field& mapped) { mapped.valuesAndGradients(points, answers); });
  expectFound([&](const Field& mapped) { mapped.forEachCell([](const Cell&) {}); });
  expectFound([&](const Field& mapped) { measureJumps(mapped); });
  EXPECT_EQ(statistics(load(file(), Loading::mapped)).leaves, statistics(field).leaves) << "needs no coefficients";
  expectFound([&](const Field& mapped) { findJumps(mapped); });
  expectFound([&](const Field& mapped) { weaklyContinuous(mapped, {}); });
  expectFound([&](const Field& mapped) { save(mapped, folder_.path() / "again.hpsdf"); });
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "again.hpsdf")) << "nothing is half written";
}

/// Bits that do not match their checksum are found when a field is opened, unless they belong to coefficients.
TEST_F(Mapped, damagedOctreesAreRefusedAtOnce) {
  save(torusField(CoefficientType::quantized), file());
  const std::string whole = readAll(file());
  std::mt19937_64 random(3);
  for (int n = 0; n < 300; ++n) {
    std::string bytes = whole;
    const std::size_t position = n % 2 == 0 ? random() % 4000 : bytes.size() - 1 - random() % 64;
    bytes[position] = char(bytes[position] ^ (1 << (random() % 8)));
    writeAll(file(), bytes);
    EXPECT_NE(messageOf([&] { load(file(), Loading::mapped); }), "") << position;
  }
}

/// A leaf whose bytes are not well formed, although their checksum is right, is not read beyond the end.
TEST_F(Mapped, forgedQuantizedLeavesAreNotReadBeyondTheEnd) {
  const Field field = torusField(CoefficientType::quantized);
  save(field, file());
  std::string bytes = readAll(file());
  const auto& coefficients = std::get<QuantizedCoefficients>(field.data().coefficients).bytes;
  const std::string stored(reinterpret_cast<const char*>(coefficients.all().data()), coefficients.size());
  const std::size_t at = bytes.find(stored);
  ASSERT_NE(at, std::string::npos);
  std::fill_n(bytes.begin() + std::ptrdiff_t(at), stored.size() - 4096, char(0xff));
  writeAll(file(), support::withBlockChecksums(bytes));
  EXPECT_NE(messageOf([&] { load(file()); }).find("not well formed"), std::string::npos);
  const Field mapped = load(file(), Loading::mapped);
  for (const Vector3& point : randomPoints(field.domain(), 2000)) mapped.value(point);
  std::fill_n(bytes.begin() + std::ptrdiff_t(at), stored.size(), char(0xff));
  writeAll(file(), support::withBlockChecksums(bytes));
  EXPECT_NE(messageOf([&] { load(file(), Loading::mapped); }).find("not well formed"), std::string::npos);
}

TEST_F(Mapped, theLastLeavesAreCheckedAtOnceAndNameTheFileOnce) {
  const Field field = torusField(CoefficientType::quantized);
  save(field, file());
  std::string bytes = readAll(file());
  const auto& coefficients = std::get<QuantizedCoefficients>(field.data().coefficients).bytes;
  const std::string stored(reinterpret_cast<const char*>(coefficients.data()), coefficients.size());
  bytes[bytes.find(stored) + stored.size() - 20] ^= 1;
  writeAll(file(), bytes);
  const std::string message = messageOf([&] { load(file(), Loading::mapped); });
  EXPECT_TRUE(message.starts_with(file().string() + ": the field file is damaged")) << message;
  EXPECT_EQ(message.find(file().string(), 1), std::string::npos) << message;
}

/// Numbers that are not finite are found where they are read, although their checksum is right.
TEST_F(Mapped, coefficientsAreFinite) {
  for (const auto type : {CoefficientType::float64, CoefficientType::float32}) {
    const Field field = torusField(type);
    save(field, file());
    std::string bytes = readAll(file());
    const std::size_t numberBytes = type == CoefficientType::float64 ? 8 : 4;
    const std::size_t at = bytes.size() / 2 / numberBytes * numberBytes + numberBytes - 2;
    bytes[at] = char(0xff), bytes[at + 1] = char(0x7f);
    writeAll(file(), support::withBlockChecksums(bytes));
    EXPECT_NE(messageOf([&] { load(file()); }).find("a coefficient is not finite"), std::string::npos);
    const Field mapped = load(file(), Loading::mapped);
    EXPECT_NE(messageOf([&] { mapped.forEachCell([](const Cell&) {}); }).find("a coefficient is not finite"),
              std::string::npos);
  }
}

TEST_F(Mapped, fieldsWithExactLeavesAndBoundsAreMapped) {
  const ExactDistance gear(loadMesh("builtin:gear"));
  const Field field =
      build(gear, domainAround(gear.source().box), {.targetError = 1e-4, .strategy = Strategy::hpx, .bounds = true});
  ASSERT_FALSE(field.data().exact.empty());
  save(field, file());
  const Field mapped = load(file(), Loading::mapped);
  ASSERT_TRUE(mapped.isMapped());
  EXPECT_EQ(mapped.data().bounds.size(), field.data().bounds.size());
  for (const Vector3& point : randomPoints(field.domain(), 2000)) EXPECT_EQ(mapped.value(point), field.value(point));
}

TEST_F(Mapped, severalThreadsBeginTogether) {
  const Field field = torusField(CoefficientType::float64);
  save(field, file());
  const Field mapped = load(file(), Loading::mapped);
  const std::vector<Vector3> points = randomPoints(field.domain(), 2000);
  std::vector<std::vector<double>> found(4, std::vector<double>(points.size()));
  std::vector<std::thread> threads;
  for (auto& values : found) threads.emplace_back([&] { mapped.values(points, values); });
  for (std::thread& thread : threads) thread.join();
  std::vector<double> expected(points.size());
  field.values(points, expected);
  for (const auto& values : found) EXPECT_EQ(values, expected);
}

/// Writes bytes and returns those that both readers read.
class BlockedFile : public Mapped {
 protected:
  static constexpr detail::FileKind kKind{"test file", "a test file", "write it again"};

  void write(const std::vector<std::uint8_t>& bytes) const {
    detail::BlockWriter writer(file());
    writer.put(std::as_bytes(std::span(bytes)));
    writer.finish();
  }
  template <typename Reader>
  std::vector<std::uint8_t> read(std::size_t count) const {
    Reader reader(file(), kKind);
    std::vector<std::uint8_t> bytes(count);
    reader.get(std::as_writable_bytes(std::span(bytes)));
    reader.finish();
    return bytes;
  }
};

std::vector<std::uint8_t> randomBytes(std::size_t count) {
  std::mt19937_64 random(5);
  std::vector<std::uint8_t> bytes(count);
  for (std::uint8_t& byte : bytes) byte = std::uint8_t(random());
  return bytes;
}

TEST_F(BlockedFile, anyNumberOfBytesIsRead) {
  for (const std::size_t count :
       {std::size_t{1}, std::size_t{8}, kBlock - 1, kBlock, kBlock + 1, 2 * kBlock, 3 * kBlock - 8, 3 * kBlock + 8}) {
    const std::vector<std::uint8_t> bytes = randomBytes(count);
    write(bytes);
    EXPECT_EQ(read<detail::BlockStreamReader>(count), bytes);
    EXPECT_EQ(read<detail::MappedBlockReader>(count), bytes);
    const std::string whole = readAll(file());
    EXPECT_EQ(whole.size(), count + (count + kBlock - 1) / kBlock * 8 + 8);
    for (const std::size_t length : {whole.size() - 1, whole.size() - 8, whole.size() - 9, std::size_t{15}}) {
      writeAll(file(), whole.substr(0, length));
      EXPECT_NE(messageOf([&] { read<detail::BlockStreamReader>(count); }), "") << count << " " << length;
      EXPECT_NE(messageOf([&] { read<detail::MappedBlockReader>(count); }), "") << count << " " << length;
    }
    for (const std::size_t at : {std::size_t{0}, count - 1, count, whole.size() - 1}) {
      std::string damaged = whole;
      damaged[at] ^= 1;
      writeAll(file(), damaged);
      EXPECT_NE(messageOf([&] { read<detail::BlockStreamReader>(count); }), "") << count << " " << at;
      EXPECT_NE(messageOf([&] { read<detail::MappedBlockReader>(count); }), "") << count << " " << at;
    }
  }
}

TEST_F(BlockedFile, blocksAreReadInAnyOrderAndMoreThanMemoryHolds) {
  constexpr std::size_t kBlocks = 100;
  const std::vector<std::uint8_t> bytes = randomBytes(kBlocks * kBlock);
  write(bytes);
  const detail::CheckedBlocks blocks(file(), kKind, 20);
  const auto expectBlock = [&](std::size_t block) {
    blocks.require(block * kBlock + 10, kBlock - 20);
    EXPECT_TRUE(std::ranges::equal(blocks.content().subspan(block * kBlock, kBlock),
                                   std::as_bytes(std::span(bytes)).subspan(block * kBlock, kBlock)));
  };
  for (int pass = 0; pass < 2; ++pass)
    for (std::size_t block = 0; block < kBlocks; ++block) expectBlock(block);
  std::mt19937_64 random(6);
  for (int n = 0; n < 300; ++n) expectBlock(random() % kBlocks);
  blocks.require(0, 0);
  blocks.require(bytes.size(), 0);
}

TEST_F(Mapped, filesThatCannotBeMappedSayWhy) {
  const Field field = torusField(CoefficientType::float32);
  save(field, file(), {.compress = true});
  EXPECT_NE(messageOf([&] { load(file(), Loading::mapped); }).find("cannot be mapped, because it is compressed"),
            std::string::npos);
  EXPECT_NE(messageOf([&] { load(folder_.path() / "none.hpsdf", Loading::mapped); }).find("no such file"),
            std::string::npos);
  EXPECT_FALSE(canBeMapped(folder_.path() / "none.hpsdf"));
  save(field, file());
  EXPECT_TRUE(canBeMapped(file()));
  std::string old = readAll(file());
  old[8] = 10;
  writeAll(file(), old);
  EXPECT_NE(messageOf([&] { load(file(), Loading::mapped); }).find("because it has an older version"),
            std::string::npos);
}

}  // namespace mapped_field_test
}  // namespace hpsdf
