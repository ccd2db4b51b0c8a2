// Tests field files whose arrays are compressed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "../support/file_checksums.h"
#include "../support/made_meshes.h"
#include "../support/random_field.h"
#include "../support/temporary_directory.h"
#include "../support/test_mesh.h"
#include "field/io/quantized_streams.h"
#include "field/query/quantized.h"
#include "hpsdf/build.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/shapes.h"
#include "hpsdf/verify.h"

namespace hpsdf {
namespace compressed_field_test {

using support::withChecksum;

constexpr SaveOptions kCompressed{.compress = true};

std::string readAll(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void writeAll(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

/// Returns the bytes of the file that `save` writes.
std::string saved(const Field& field, const SaveOptions& options = {}) {
  const support::TemporaryDirectory folder;
  save(field, folder / "saved.hpsdf", options);
  return readAll(folder / "saved.hpsdf");
}

/// Loads a file with these bytes.
Field loaded(const std::string& bytes) {
  const support::TemporaryDirectory folder;
  writeAll(folder / "given.hpsdf", bytes);
  return load(folder / "given.hpsdf");
}

/// Returns the message of the error with which a file with these bytes is refused; empty if it loads.
std::string refusal(const std::string& bytes) {
  try {
    loaded(bytes);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

/// Expects that the field is the same after it was saved with compression and loaded. The uncompressed files are equal
/// if all that files store is equal.
void expectRoundTrip(const Field& field) {
  const std::string plain = saved(field), compressed = saved(field, kCompressed);
  EXPECT_TRUE(saved(field, kCompressed) == compressed) << "the same field gives the same bytes";
  const Field again = loaded(compressed);
  EXPECT_EQ(again.data().nodes, field.data().nodes);
  EXPECT_TRUE(again.data().coefficients == field.data().coefficients);
  EXPECT_TRUE(saved(again) == plain);
  EXPECT_TRUE(saved(again, kCompressed) == compressed);
}

double torus(const Vector3& x) { return std::hypot(std::hypot(x.x(), x.y()) - 0.7, x.z()) - 0.3; }

BuildOptions fine(CoefficientType type) {
  return {.targetError = 1e-5, .grid = {2, 3, 4}, .maxDegree = 6, .maxDepth = 3, .coefficients = type};
}

Field torusField(const BuildOptions& options) {
  const Source source{"tōrus.obj", 0x123456789abcdef0u, 5, 6, Box(Vector3::Constant(-1), Vector3::Constant(1))};
  return build(DistanceFunction(torus, source), Box(Vector3::Constant(-1.1), Vector3::Constant(1.1)), options);
}

TEST(CompressedField, everyKindOfCoefficientsIsKept) {
  for (const auto type : {CoefficientType::float32, CoefficientType::float64, CoefficientType::quantized}) {
    const Field field = torusField(fine(type));
    expectRoundTrip(field);
    EXPECT_LT(saved(field, kCompressed).size(), 0.85 * double(saved(field).size())) << int(type);
  }
}

/// Leaves with steps of their own, some of them wide, are taken apart into integers like all others.
TEST(CompressedField, wideLeavesAreKept) {
  const Field field = randomField(5, {.maxDepth = 2, .minDegree = 0, .maxDegree = 6});
  std::mt19937_64 random(3);
  std::vector<double> steps(field.data().nodes.size());
  for (double& step : steps) step = std::exp2(-std::uniform_real_distribution<double>(6, 28)(random));
  query::Quantized quantized = query::quantized(field.data(), steps).value();
  EXPECT_TRUE(std::ranges::any_of(quantized.nodes, node::isWide));
  FieldData data = field.data();
  query::take(std::move(quantized), data);
  io::StreamsWriter streams;
  std::vector<std::uint64_t> leaves;
  for (const std::uint64_t node : data.nodes)
    if (node::isLeaf(node)) leaves.push_back(node & ~std::uint64_t{0xffffffff});
  EXPECT_TRUE(io::addQuantized(streams, std::get<QuantizedCoefficients>(data.coefficients), leaves));
  expectRoundTrip(Field(std::move(data)));
}

TEST(CompressedField, everyKindOfFieldIsKept) {
  std::vector<BuildOptions> kinds(7, fine(CoefficientType::float32));
  kinds[0].band = 0.2;
  kinds[1].bounds = true;
  kinds[2].blend = 0.1;
  kinds[3].continuityWeight = 1;
  kinds[4].maxSteps = 0;
  kinds[5].strategy = Strategy::h2;
  kinds[6].grid = {1, 1, 1}, kinds[6].maxDepth = 0, kinds[6].maxDegree = 1;
  for (const BuildOptions& options : kinds) expectRoundTrip(torusField(options));
}

TEST(CompressedField, theMeasurementIsKept) {
  Measurement measurement;
  measurement.points = 20000;
  measurement.near = {.rms = 1e-4, .max = 2e-3};
  expectRoundTrip(withMeasurement(torusField(fine(CoefficientType::quantized)), measurement));
}

/// Returns two boxes, one of which reaches into the other, so that signs follow from the winding number.
TriangleMesh overlappingBoxes() {
  return support::joined(support::boxOfTwo(), support::moved(support::boxOfTwo(), {0.7, 0.6, 0.5}));
}

Field exactField(const TriangleMesh& mesh, BuildOptions options, const DistanceOptions& distance = {}) {
  options.strategy = Strategy::hpx;
  options.grid = {3, 3, 3};
  Field field = build(ExactDistance(mesh, distance), domainAround(mesh), options);
  EXPECT_FALSE(field.data().exact.empty());
  return field;
}

TEST(CompressedField, exactLeavesAreKept) {
  const BuildOptions plain{.targetError = 1e-4};
  BuildOptions doubles = plain, blended = plain;
  doubles.coefficients = CoefficientType::float64;
  blended.blend = 0.1;
  blended.bounds = true;
  const TriangleMesh gear = shapes::mesh("gear");
  for (const BuildOptions& options : {plain, doubles, blended}) expectRoundTrip(exactField(gear, options));
  expectRoundTrip(exactField(overlappingBoxes(), plain));
  expectRoundTrip(exactField(support::openBox(), plain, {.insideTest = InsideTest::shell, .thickness = 0.1}));
}

TEST(CompressedField, aPartOfCadIsKept) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const Field field = exactField(loadMesh(support::testMesh("cad/fandisk.obj")), {.targetError = 1e-4});
  expectRoundTrip(field);
  EXPECT_LT(saved(field, kCompressed).size(), 0.5 * double(saved(field).size()));
}

TEST(CompressedField, fieldsThatNoConstructionLaidOutAreKept) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    RandomFieldOptions options;
    options.single = seed % 2 == 0;
    options.grid = {1, 2, 3};
    expectRoundTrip(randomField(seed, options));
  }
}

/// Returns the number of bytes that a leaf takes.
std::size_t bytesOfLeaf(const FieldData& data, std::uint64_t leaf) {
  return query::quantizedLeafBytes(std::get<QuantizedCoefficients>(data.coefficients), leaf);
}

/// Leaves may share their coefficients, stand in any order, and leave gaps between them.
TEST(CompressedField, quantizedLeavesMayStandInAnyOrder) {
  const FieldData data = torusField(fine(CoefficientType::quantized)).data();
  const auto isLeaf = [](std::uint64_t node) { return node::isLeaf(node); };
  const auto first = std::ranges::find_if(data.nodes, isLeaf);
  const auto second = std::find_if(first + 1, data.nodes.end(), isLeaf);
  const auto at = [&](auto node) { return node - data.nodes.begin(); };

  FieldData exchanged = data;
  std::swap(exchanged.nodes[at(first)], exchanged.nodes[at(second)]);
  expectRoundTrip(Field(exchanged));

  FieldData shared = data;
  shared.nodes[at(second)] = *first;
  expectRoundTrip(Field(shared));

  FieldData gap = data;
  auto& bytes = std::get<QuantizedCoefficients>(gap.coefficients).bytes.values();
  bytes.insert(bytes.begin(), 3, 0x5a);
  for (std::uint64_t& node : gap.nodes)
    if (node::isLeaf(node)) node += 3;
  expectRoundTrip(Field(gap));

  // The bits that fill up the last byte of a leaf have no meaning and are kept.
  FieldData filled = data;
  auto& coefficients = std::get<QuantizedCoefficients>(filled.coefficients);
  coefficients.bytes.values()[node::offset(*first) + bytesOfLeaf(filled, *first) - 1] |= 0x80;
  coefficients.bytes.values()[node::offset(*second) + bytesOfLeaf(filled, *second) - 1] |= 0x80;
  coefficients.bytes.values().back() = 1;
  expectRoundTrip(Field(filled));
}

TEST(CompressedField, offsetsMayHaveAnyOrder) {
  FieldData data = torusField(fine(CoefficientType::float32)).data();
  auto& coefficients = std::get<FieldArray<float>>(data.coefficients).values();
  const std::vector<float> before = coefficients;
  coefficients.clear();
  for (auto node = data.nodes.rbegin(); node != data.nodes.rend(); ++node) {
    if (!node::isLeaf(*node)) continue;
    const int degree = node::degree(*node);
    const auto from = before.begin() + node::offset(*node);
    *node = node::leaf(degree, std::uint32_t(coefficients.size()));
    coefficients.insert(coefficients.end(), from, from + coefficientCount(degree));
  }
  expectRoundTrip(Field(data));
}

/// Returns small compressed files of every kind.
std::vector<std::string> everyKind() {
  std::vector<std::string> files;
  for (const auto type : {CoefficientType::float32, CoefficientType::float64, CoefficientType::quantized}) {
    BuildOptions options = fine(type);
    options.targetError = 1e-3;
    options.grid = {1, 2, 2};
    options.maxDepth = 2;
    options.bounds = true;
    files.push_back(saved(torusField(options), kCompressed));
  }
  files.push_back(saved(exactField(shapes::mesh("gear"), {.targetError = 1e-2}), kCompressed));
  files.push_back(saved(exactField(overlappingBoxes(), {.targetError = 1e-2}), kCompressed));
  return files;
}

void expectOneLine(const std::string& message) {
  EXPECT_NE(message.find("given.hpsdf: "), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

TEST(CompressedField, truncatedFilesAreRefused) {
  for (const std::string& whole : everyKind()) {
    const std::size_t step = 1 + whole.size() / 150;
    for (std::size_t length = 0; length < whole.size(); length += step) {
      const std::string message = refusal(whole.substr(0, length));
      ASSERT_FALSE(message.empty()) << length << " of " << whole.size() << " bytes";
      expectOneLine(message);
      if (length + 8 >= whole.size()) continue;
      const std::string mended = refusal(withChecksum(whole.substr(0, length) + std::string(8, '\0')));
      ASSERT_FALSE(mended.empty()) << length << " bytes with a checksum";
      expectOneLine(mended);
    }
    EXPECT_NE(refusal(whole + "x").find("too long"), std::string::npos);
  }
}

TEST(CompressedField, changedBitsAreRefused) {
  std::mt19937_64 random(5);
  for (const std::string& whole : everyKind())
    for (int n = 0; n < 300; ++n) {
      std::string bytes = whole;
      char& byte = bytes[random() % bytes.size()];
      byte = char(byte ^ (1 << (random() % 8)));
      const std::string message = refusal(bytes);
      ASSERT_FALSE(message.empty()) << n;
      expectOneLine(message);
    }
}

/// A file that was changed and has a right checksum is refused, or it is another field, which is kept as any other.
TEST(CompressedField, changedBitsWithARightChecksumAreReadOrRefused) {
  std::mt19937_64 random(6);
  int read = 0;
  for (const std::string& whole : everyKind())
    for (int n = 0; n < 100; ++n) {
      std::string bytes = whole;
      for (std::uint64_t changes = 1 + random() % 3; changes > 0; --changes)
        bytes[random() % (bytes.size() - 8)] = char(random());
      bytes = withChecksum(bytes);
      try {
        const Field field = loaded(bytes);
        EXPECT_TRUE(saved(loaded(saved(field, kCompressed))) == saved(field));
        ++read;
      } catch (const Error& error) {
        expectOneLine(error.what());
      }
    }
  EXPECT_GT(read, 20) << "some changes must reach the arrays";
}

constexpr std::size_t kNodesAt = 16, kCoefficientsAt = 24, kGridAt = 32;

/// Sizes are refused before memory is taken, even if the checksum is right.
TEST(CompressedField, forgedSizesAreRefused) {
  const Field field = torusField(fine(CoefficientType::float64));
  const std::string whole = saved(field, kCompressed);
  const auto forged = [&](std::size_t position, auto value) {
    std::string bytes = whole;
    std::memcpy(&bytes[position], &value, sizeof value);
    return refusal(withChecksum(bytes));
  };
  const std::uint64_t coefficients = std::get<FieldArray<double>>(field.data().coefficients).size();
  EXPECT_EQ(forged(kCoefficientsAt, coefficients), "");
  for (const std::uint64_t count : {std::uint64_t{1} << 60, ~std::uint64_t{0}})
    EXPECT_NE(forged(kCoefficientsAt, count).find("of memory, more than the"), std::string::npos);
  EXPECT_NE(forged(kCoefficientsAt, 100000 * coefficients).find("damaged: a compressed array is too short"),
            std::string::npos);
  EXPECT_NE(forged(kCoefficientsAt, coefficients + 1).find("damaged: a compressed array has another size"),
            std::string::npos);
  EXPECT_NE(forged(kCoefficientsAt, std::uint64_t{0}), "");
  EXPECT_NE(forged(kNodesAt, std::uint64_t{1} << 32).find("2^32 nodes or more"), std::string::npos);
  EXPECT_NE(forged(kNodesAt, std::uint64_t{0}), "");
  EXPECT_NE(forged(kNodesAt, field.data().nodes.size() + 8).find("has another size"), std::string::npos);
  EXPECT_NE(forged(kGridAt, std::uint32_t{0xffffffff}).find("base grid"), std::string::npos);
  EXPECT_NE(forged(kGridAt, std::uint32_t{0}).find("base grid"), std::string::npos);
}

/// The version of a compressed file tells that it is compressed, and messages tell its version without that.
TEST(CompressedField, theVersionTellsThatTheFileIsCompressed) {
  const Field field = torusField(fine(CoefficientType::float32));
  const std::string plain = saved(field), compressed = saved(field, kCompressed);
  EXPECT_EQ(std::uint8_t(compressed[11]), 0x80);
  EXPECT_EQ(compressed.substr(0, 8), plain.substr(0, 8));
  EXPECT_EQ(compressed[8], 10);
  EXPECT_EQ(plain.substr(8, 4), std::string("\x0c\0\0\0", 4));
  std::string other = compressed;
  other[8] = 77;
  EXPECT_NE(refusal(withChecksum(other)).find("version 77,"), std::string::npos);
  other = compressed;
  other[11] = 0;
  EXPECT_NE(refusal(withChecksum(other)), "") << "compressed arrays are not those of a plain file";
  other = plain;
  other[11] = char(0x80);
  EXPECT_NE(refusal(withChecksum(other)), "");
}

}  // namespace compressed_field_test
}  // namespace hpsdf
