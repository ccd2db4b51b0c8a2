#include "hpsdf/field_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"
#include "hpsdf/verify.h"
#include "support/file_checksums.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace field_file_test {

using support::withBlockChecksums;
using support::withChecksum;

double torus(const Vector3& x) { return std::hypot(std::hypot(x.x(), x.y()) - 0.7, x.z()) - 0.3; }

Field small(CoefficientType type = CoefficientType::float64) {
  const Source source{"tōrus.obj", 0x123456789abcdef0u, 5, 6, Box(Vector3::Constant(-1), Vector3::Constant(1))};
  return build(DistanceFunction(torus, source), Box(Vector3::Constant(-1.1), Vector3::Constant(1.1)),
               {.targetError = 1e-4, .nearness = 3, .maxDegree = 9, .maxDepth = 5, .band = 0.4, .coefficients = type});
}

std::string readAll(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void writeAll(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

/// Returns the message of the error with which loading fails; empty if it succeeds.
std::string refusal(const std::filesystem::path& file) {
  try {
    load(file);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

TEST(FieldFile, roundTripKeepsEveryByteAndValue) {
  support::TemporaryDirectory folder;
  for (const auto type : {CoefficientType::float32, CoefficientType::float64, CoefficientType::quantized}) {
    const Field field = small(type);
    save(field, folder.path() / "a.hpsdf");
    const Field again = load(folder.path() / "a.hpsdf");
    save(again, folder.path() / "b.hpsdf");
    EXPECT_TRUE(readAll(folder.path() / "a.hpsdf") == readAll(folder.path() / "b.hpsdf"));
    EXPECT_EQ(again.data().nodes, field.data().nodes);
    EXPECT_EQ(again.data().coefficients, field.data().coefficients);
    EXPECT_EQ(again.metadata().source.name, "tōrus.obj");
    EXPECT_EQ(again.metadata().source.fingerprint, 0x123456789abcdef0u);
    EXPECT_EQ(again.metadata().totalError, field.metadata().totalError);
    EXPECT_EQ(again.metadata().roundingRms, field.metadata().roundingRms);
    EXPECT_EQ(again.metadata().settings.maxDepth, 5);
    EXPECT_EQ(again.metadata().settings.band, 0.4);
    EXPECT_TRUE(again.domain().isApprox(field.domain(), 0));
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> uniform(-1.5, 1.5);
    for (int n = 0; n < 1000; ++n) {
      const Vector3 x(uniform(random), uniform(random), uniform(random));
      EXPECT_EQ(again.value(x), field.value(x));
      EXPECT_EQ(again.valueAndGradient(x).gradient, field.valueAndGradient(x).gradient);
    }
  }
}

TEST(FieldFile, everyTruncationIsRefused) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "cut.hpsdf";
  save(small(), file);
  const std::string whole = readAll(file);
  for (std::size_t length = 0; length < whole.size(); length += length < 400 ? 1 : 997) {
    writeAll(file, whole.substr(0, length));
    const std::string message = refusal(file);
    ASSERT_FALSE(message.empty()) << length << " of " << whole.size() << " bytes";
    ASSERT_NE(message.find("cut.hpsdf"), std::string::npos) << message;
  }
  writeAll(file, whole + "x");
  EXPECT_NE(refusal(file).find("too long"), std::string::npos);
  std::string longer = whole;
  longer.insert(longer.size() - 16, 8, '\0');
  writeAll(file, withBlockChecksums(longer));
  EXPECT_NE(refusal(file).find("too long"), std::string::npos);
}

TEST(FieldFile, everyFlippedBitIsRefused) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "flipped.hpsdf";
  save(small(), file);
  const std::string whole = readAll(file);
  std::mt19937_64 random(2);
  for (int n = 0; n < 1500; ++n) {
    std::string bytes = whole;
    const std::size_t position = n < 400 ? std::size_t(n) % whole.size() : random() % whole.size();
    bytes[position] = char(bytes[position] ^ (1 << (random() % 8)));
    writeAll(file, bytes);
    ASSERT_FALSE(refusal(file).empty()) << "byte " << position;
  }
}

std::vector<std::string> everyKind() {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "kind.hpsdf";
  const BuildOptions plain{.targetError = 1e-3, .grid = {2, 2, 1}, .maxDegree = 4, .maxDepth = 2};
  std::vector<BuildOptions> kinds(8, plain);
  kinds[0].coefficients = CoefficientType::float32;
  kinds[1].coefficients = CoefficientType::float64;
  kinds[2].band = 0.2;
  kinds[3].bounds = true;
  kinds[4].blend = 0.1;
  kinds[5].continuityWeight = 1;
  kinds[6].maxSteps = 0;
  kinds[7].coefficients = CoefficientType::quantized;
  std::vector<std::string> files;
  for (const BuildOptions& options : kinds) {
    save(build(torus, Box(Vector3::Constant(-1.1), Vector3::Constant(1.1)), options), file);
    files.push_back(readAll(file));
  }
  return files;
}

/// Files are truncated, shortened in the middle, or have one to eight flipped bits. Half of the damaged positions lie
/// in the header.
TEST(FieldFile, twoThousandDamagedFilesOfEveryKindAreRefused) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "damaged.hpsdf";
  const std::vector<std::string> files = everyKind();
  std::mt19937_64 random(3);
  int refused = 0;
  for (int n = 0; n < 2000; ++n) {
    const std::string& whole = files[n % files.size()];
    const auto place = [&] {
      return random() % (random() % 2 == 0 ? std::min<std::size_t>(400, whole.size()) : whole.size());
    };
    std::string bytes = whole;
    if (n % 3 == 0)
      bytes.resize(place());
    else if (n % 10 == 1)
      bytes.erase(place(), 1 + random() % 64);
    else
      for (std::uint64_t bits = 1 + random() % 8; bits > 0 || bytes == whole; bits -= bits > 0) {
        char& byte = bytes[place()];
        byte = char(byte ^ (1 << (random() % 8)));
      }
    writeAll(file, bytes);
    const std::string message = refusal(file);
    refused += !message.empty();
    EXPECT_TRUE(message.starts_with(file.string() + ": ") && message.find('\n') == std::string::npos) << n << message;
  }
  EXPECT_EQ(refused, 2000);
}

TEST(FieldFile, otherFilesAreNamedForWhatTheyAre) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "other.hpsdf";
  EXPECT_NE(refusal(file).find("no such file"), std::string::npos);
  EXPECT_NE(refusal(folder.path()).find("folder"), std::string::npos);
  writeAll(file, "");
  EXPECT_NE(refusal(file).find("not a .hpsdf file"), std::string::npos);
  writeAll(file, "solid cube\nfacet normal 0 0 1\n");
  EXPECT_NE(refusal(file).find("not a .hpsdf file"), std::string::npos);
  save(small(), file);
  std::string bytes = readAll(file);
  bytes[8] = 99;
  writeAll(file, bytes);
  EXPECT_NE(refusal(file).find("version 99"), std::string::npos);
}

/// Where the parts of a file of version 12 are.
struct Layout {
  explicit Layout(const FieldData& data) : settings(277 + data.metadata.source.name.size()) {
    const bool isQuantized = std::holds_alternative<QuantizedCoefficients>(data.coefficients);
    exactness = settings + 44 + 9 + 91;
    nodes = aligned(exactness + 1 + (isQuantized ? 12 : 0));
    coefficients = aligned(nodes + 8 * data.nodes.size());
    bounds = aligned(coefficients + coefficientBytes(data));
  }

  static std::size_t aligned(std::size_t position) { return (position + 63) / 64 * 64; }

  std::size_t settings;   ///< those since version 3
  std::size_t exactness;  ///< that tells whether there is an exactness
  std::size_t nodes, coefficients, bounds;
};

/// Returns the bytes of a file as version 10 has them: arrays without padding, and one checksum at the end.
std::string asVersion10(const FieldData& data, const std::string& bytes) {
  const Layout layout(data);
  const bool isQuantized = std::holds_alternative<QuantizedCoefficients>(data.coefficients);
  std::string old = bytes.substr(0, layout.exactness);
  old[8] = 10;
  old += bytes.substr(layout.exactness + 1, isQuantized ? 12 : 0);
  old += bytes.substr(layout.nodes, 8 * data.nodes.size());
  old += bytes.substr(layout.coefficients, coefficientBytes(data));
  return withChecksum(old + std::string(8, '\0'));
}

constexpr std::size_t kSinceVersion3 = 4 * 1 + 4 * 8 + 8, kSinceVersion4 = 1 + 8,
                      kSinceVersion8 =
                          8 + 4 + 8 + 8 + 8 + 1 + 1 + 1 + 8 + 4 + 4 * 8 + 8;  // bytes that versions 3, 4 and 8 added

/// Version 9 had no shifts and no wide leaves, which differ from 0 only with limits of the change.
TEST(FieldFile, quantizedFilesOfVersion9AreRead) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "old.hpsdf";
  const Field field =
      build([](const Vector3& x) { return x.norm() - 0.7; }, Box(Vector3::Constant(-1), Vector3::Ones()),
            {.targetError = 1e-4, .grid = {2, 2, 2}, .coefficients = CoefficientType::quantized});
  ASSERT_EQ(precisionName(field), "quantized");
  save(field, file);
  std::string bytes = asVersion10(field.data(), readAll(file));
  writeAll(file, bytes);
  EXPECT_EQ(load(file).data().coefficients, field.data().coefficients);
  bytes[8] = 9;
  writeAll(file, withChecksum(bytes));
  EXPECT_EQ(load(file).data().coefficients, field.data().coefficients);
  EXPECT_EQ(load(file).data().nodes, field.data().nodes);
}

/// Older files end their headers earlier: version 8 before the step of quantized coefficients, version 4 before
/// settings and sizes of exact leaves, the tolerance and the number of measured points, version 3 before the inside
/// test, version 2 before the settings that follow the number of steps, and version 1 before the number of steps.
TEST(FieldFile, filesOfOlderVersionsAreRead) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "old.hpsdf";
  const Field field = small();
  ASSERT_GT(field.metadata().steps.value(), 0u);
  save(field, file);
  EXPECT_EQ(load(file).metadata().steps, field.metadata().steps);
  std::string bytes = asVersion10(field.data(), readAll(file));
  writeAll(file, bytes);
  EXPECT_EQ(load(file).data().coefficients, field.data().coefficients);
  const std::size_t coefficients = std::get<FieldArray<double>>(field.data().coefficients).size();
  const std::size_t nodes = bytes.size() - 8 - 8 * (coefficients + field.data().nodes.size());
  bytes[8] = 8;
  writeAll(file, withChecksum(bytes));
  EXPECT_EQ(load(file).data().coefficients, field.data().coefficients);
  bytes[8] = 4;
  writeAll(file, withChecksum(bytes.erase(nodes - kSinceVersion8, kSinceVersion8)));
  EXPECT_EQ(load(file).metadata().source.insideTest, field.metadata().source.insideTest);
  EXPECT_EQ(load(file).data().nodes, field.data().nodes);
  bytes[8] = 3;
  writeAll(file, withChecksum(bytes.erase(nodes - kSinceVersion8 - kSinceVersion4, kSinceVersion4)));
  EXPECT_EQ(load(file).metadata().measuredError, field.metadata().measuredError);
  EXPECT_EQ(load(file).data().nodes, field.data().nodes);
  const std::size_t sinceSteps = nodes - kSinceVersion8 - kSinceVersion4 - kSinceVersion3;
  bytes[8] = 2;
  writeAll(file, withChecksum(bytes.erase(sinceSteps, kSinceVersion3)));
  EXPECT_EQ(load(file).metadata().steps, field.metadata().steps);
  EXPECT_EQ(load(file).data().nodes, field.data().nodes);
  bytes[8] = 1;
  writeAll(file, withChecksum(bytes.erase(sinceSteps - 8, 8)));
  const Field old = load(file);
  EXPECT_EQ(old.metadata().steps, std::nullopt);
  EXPECT_EQ(old.metadata().roundingRms, field.metadata().roundingRms);
  EXPECT_EQ(old.data().nodes, field.data().nodes);
  EXPECT_EQ(old.data().coefficients, field.data().coefficients);
  save(old, file);
  EXPECT_EQ(load(file).metadata().steps, std::nullopt) << "what is unknown stays so";
}

TEST(FieldFile, theMeasurementIsKept) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "measured.hpsdf";
  const Measurement measurement{.points = 20000,
                                .nearDistance = 0.01,
                                .near = {.rms = 1e-4, .max = 2e-3},
                                .domain = {.rms = 3e-4, .max = 4e-3},
                                .wrongSigns = 5,
                                .signThreshold = 1e-3,
                                .tornShare = 0.0625,
                                .worst = {0.25, -0.5, 0.75},
                                .toleranceRatio = 1.5,
                                .beyondTolerance = 7};
  save(withMeasurement(small(), measurement), file);
  const std::optional<Measurement> found = load(file).metadata().measurement;
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->points, measurement.points);
  EXPECT_EQ(found->nearDistance, measurement.nearDistance);
  EXPECT_EQ(found->near.rms, measurement.near.rms);
  EXPECT_EQ(found->near.max, measurement.near.max);
  EXPECT_EQ(found->domain.rms, measurement.domain.rms);
  EXPECT_EQ(found->domain.max, measurement.domain.max);
  EXPECT_EQ(found->wrongSigns, measurement.wrongSigns);
  EXPECT_EQ(found->signThreshold, measurement.signThreshold);
  EXPECT_EQ(found->tornShare, measurement.tornShare);
  EXPECT_EQ(found->worst, measurement.worst);
  EXPECT_EQ(found->toleranceRatio, measurement.toleranceRatio);
  EXPECT_EQ(found->beyondTolerance, measurement.beyondTolerance);
  EXPECT_EQ(load(file).data().nodes, small().data().nodes);
}

/// Fields of versions 5 and 6 were written during the development of version 0.2.0 and have other contents.
TEST(FieldFile, versionsThatWereNeverReleasedAreRefused) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "never.hpsdf";
  save(small(), file);
  for (const char version : {char{5}, char{6}}) {
    std::string bytes = readAll(file);
    bytes[8] = version;
    writeAll(file, withChecksum(bytes));
    EXPECT_NE(refusal(file).find("version " + std::to_string(version)), std::string::npos);
  }
}

TEST(FieldFile, continuityAndBoundsAreKept) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "more.hpsdf";
  FieldData data = small().data();
  data.blend = 0.125;
  data.bounds.assign(data.nodes.size(), CellBound{0.25f, 1.5f});
  data.metadata.settings.estimator = Estimator::residual;
  data.metadata.settings.criterion = Criterion::optimal;
  data.metadata.settings.nearnessKind = NearnessKind::exponential;
  data.metadata.settings.maxError = 0.01;
  data.metadata.measuredError = 0.0075;
  data.metadata.settings.enrich = true;
  data.metadata.settings.continuityWeight = 3;
  data.metadata.settings.tolerance = 0.001;
  data.metadata.settings.within = 0.25;
  data.metadata.settings.certified = true;
  data.metadata.settings.cubature = CubatureKind::product;
  data.metadata.settings.trialSamples = TrialSamples::own;
  data.metadata.settings.maxBytes = 5'000'000'000;
  data.metadata.source.insideTest = InsideTest::shell;
  data.metadata.source.thickness = 0.125;
  save(Field(data), file);
  const Field again = load(file);
  EXPECT_EQ(again.data().blend, 0.125);
  ASSERT_EQ(again.data().bounds.size(), data.nodes.size());
  EXPECT_EQ(again.data().bounds.back().error, 0.25f);
  EXPECT_EQ(again.data().bounds.back().slope, 1.5f);
  EXPECT_EQ(again.metadata().source.insideTest, InsideTest::shell);
  EXPECT_EQ(again.metadata().source.thickness, 0.125);
  EXPECT_EQ(again.metadata().settings.estimator, Estimator::residual);
  EXPECT_EQ(again.metadata().settings.criterion, Criterion::optimal);
  EXPECT_EQ(again.metadata().settings.nearnessKind, NearnessKind::exponential);
  EXPECT_EQ(again.metadata().settings.maxError, 0.01);
  EXPECT_EQ(again.metadata().measuredError, 0.0075);
  EXPECT_TRUE(again.metadata().settings.enrich);
  EXPECT_EQ(again.metadata().settings.continuityWeight, 3);
  EXPECT_EQ(again.metadata().settings.tolerance, 0.001);
  EXPECT_EQ(again.metadata().settings.within, 0.25);
  EXPECT_TRUE(again.metadata().settings.certified);
  EXPECT_EQ(again.metadata().settings.cubature, CubatureKind::product);
  EXPECT_EQ(again.metadata().settings.trialSamples, TrialSamples::own);
  EXPECT_EQ(again.metadata().settings.maxBytes, 5'000'000'000) << "more than 32 bits hold";
}

/// Invalid blend widths, bounds and settings are refused even if the checksum is right.
TEST(FieldFile, forgedContinuityAndBoundsAreRefused) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "forged.hpsdf";
  FieldData data = small().data();
  data.blend = 0.125;
  data.bounds.assign(data.nodes.size(), CellBound{0.25f, 1.5f});
  save(Field(data), file);
  const std::string bytes = readAll(file);
  const Layout layout(data);
  const std::size_t count = data.nodes.size(), bounds = layout.bounds, since = layout.settings;
  const auto refused = [&](std::size_t at, auto value) {
    std::string forged = bytes;
    std::memcpy(&forged[at], &value, sizeof(value));
    writeAll(file, withBlockChecksums(forged));
    return !refusal(file).empty();
  };
  EXPECT_FALSE(refused(since + 28, 0.25)) << "the greatest width";
  for (const double width : {-0.1, 0.2501, 1e300, double(NAN)}) EXPECT_TRUE(refused(since + 28, width)) << width;
  for (const std::uint64_t number : {std::uint64_t{1}, count - 1, count + 1, std::uint64_t{1} << 61, ~std::uint64_t{0}})
    EXPECT_TRUE(refused(since + 36, number)) << number;
  for (const std::size_t at : {bounds, bounds + 4, bounds + 8 * count - 4})
    for (const float bound : {-1.0f, NAN}) EXPECT_TRUE(refused(at, bound)) << at;
  EXPECT_FALSE(refused(bounds, 1e30f));
  for (const std::size_t flag : {0, 1, 2, 19}) EXPECT_TRUE(refused(since + flag, std::uint8_t{3})) << flag;
  EXPECT_FALSE(refused(since + kSinceVersion3, InsideTest::shell));
  EXPECT_TRUE(refused(since + kSinceVersion3, std::uint8_t{5})) << "sign";
}

/// Even with a right checksum, a malicious file must not cause huge allocations or crashes.
TEST(FieldFile, forgedFilesAreRefused) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "forged.hpsdf";
  save(small(), file);
  const std::string whole = readAll(file);
  const auto forge = [&](std::size_t position, auto value) {
    std::string bytes = whole;
    std::memcpy(&bytes[position], &value, sizeof(value));
    writeAll(file, withBlockChecksums(bytes));
    return refusal(file);
  };
  EXPECT_EQ(forge(0, whole[0]), "");  // an unchanged file with its checksum recomputed is valid
  EXPECT_NE(forge(16, std::uint64_t{1} << 61), "");
  EXPECT_NE(forge(24, std::uint64_t{1} << 61), "");
  EXPECT_NE(forge(12, std::uint32_t{5}), "");
  EXPECT_NE(forge(32, std::uint32_t{0xffffffff}), "");
  const std::size_t header = 12 + 4 + 16 + 12 + 48;
  EXPECT_NE(forge(header, std::uint32_t{0xffffffff}), "");  // length of the name
  const Layout layout(small().data());
  ASSERT_GT(layout.nodes - 1, layout.exactness);
  EXPECT_NE(forge(layout.nodes - 1, '\1').find("its padding is not 0"), std::string::npos);
}

TEST(Error, showsZeroBytesAsBlanks) {
  const std::string zero(1, '\0');
  const Error error("a" + zero + "b"), named(ErrorKind::file, "c" + zero + "d", "is" + zero + " gone");
  EXPECT_STREQ(error.what(), "a b");
  EXPECT_STREQ(named.what(), "c d: is  gone");
  EXPECT_EQ(named.problem(), "is  gone");
  EXPECT_EQ(named.subject(), "c" + zero + "d");
}

TEST(OutputFile, followsSymbolicLinks) {
  support::TemporaryDirectory folder;
  const auto write = [&](const char* name) {
    OutputFile output(folder.path() / name);
    output.write(name);
    output.commit();
  };
  std::filesystem::create_directory(folder.path() / "real");
  std::filesystem::create_symlink("real/target", folder.path() / "link");
  for (int round = 0; round < 2; ++round) {  // the target is missing in the first round
    write("link");
    EXPECT_TRUE(std::filesystem::is_symlink(folder.path() / "link"));
    EXPECT_EQ(readAll(folder.path() / "real/target"), "link");
  }
  std::filesystem::create_symlink(folder.path() / "real/other", folder.path() / "absolute");
  write("absolute");
  EXPECT_EQ(readAll(folder.path() / "real/other"), "absolute");
  std::filesystem::create_symlink("two", folder.path() / "one");
  std::filesystem::create_symlink("one", folder.path() / "two");
  EXPECT_THROW(OutputFile(folder.path() / "one"), Error);
}

TEST(OutputFile, appearsWholeOrNotAtAll) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "out.txt";
  writeAll(file, "old");
  {
    OutputFile output(file);
    output.write("half");
  }
  EXPECT_EQ(readAll(file), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
  OutputFile output(file);
  output.write("new");
  output.commit();
  EXPECT_EQ(readAll(file), "new");
  EXPECT_THROW(OutputFile{folder.path()}, Error);
  EXPECT_THROW(OutputFile{folder.path() / "no" / "such" / "folder.txt"}, Error);
  EXPECT_THROW(OutputFile{""}, Error);
  EXPECT_THROW(checkWritable("/dev/full"), Error);
  EXPECT_NO_THROW(checkWritable(folder.path() / "later.txt"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "later.txt"));
}

}  // namespace field_file_test
}  // namespace hpsdf
