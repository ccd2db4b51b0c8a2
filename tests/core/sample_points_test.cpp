#include "hpsdf/output/sample_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/hpsdf.h"
#include "support/made_meshes.h"
#include "support/temporary_directory.h"
#include "support/winding_by_hand.h"

namespace hpsdf {
namespace sample_points_test {

constexpr SamplePointsOptions kNone = {.surface = 0, .near = 0, .uniform = 0};

SamplePointsOptions only(PointKind kind, std::size_t count) {
  SamplePointsOptions options = kNone;
  (kind == PointKind::surface ? options.surface
   : kind == PointKind::edge  ? options.edge
   : kind == PointKind::near  ? options.near
                              : options.uniform) = count;
  return options;
}

SamplePoints samplesOf(const TriangleMesh& mesh, const SamplePointsOptions& options) {
  return samplePoints(mesh, ExactDistance(mesh), options);
}

/// Returns the statistic of Pearson's χ² test, divided by its degrees of freedom: about 1 if counts have the shares
/// that are expected.
double chiSquare(const std::vector<std::size_t>& counts, const std::vector<double>& sizes) {
  double total = 0, all = 0, sum = 0;
  for (const double size : sizes) total += size;
  for (const std::size_t count : counts) all += double(count);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double expected = all * sizes[i] / total;
    sum += (double(counts[i]) - expected) * (double(counts[i]) - expected) / expected;
  }
  return sum / double(counts.size() - 1);
}

double areaOf(const TriangleMesh& mesh, std::size_t triangle) {
  const auto [a, b, c] = cornersOf(mesh, mesh.triangles[triangle]);
  return (b - a).cross(c - a).norm() / 2;
}

TEST(SamplePoints, areUniformByAreaOnTheSurface) {
  const TriangleMesh mesh = shapes::mesh("gear");
  const SamplePoints samples = samplesOf(mesh, only(PointKind::surface, 200'000));
  std::vector<std::size_t> counts(mesh.triangles.size());
  std::vector<double> areas;
  for (const std::uint32_t face : samples.faces) ++counts[face];
  for (std::size_t t = 0; t < counts.size(); ++t) areas.push_back(areaOf(mesh, t));
  // With 1727 degrees of freedom, the statistic is 1 ± 0.034.
  EXPECT_NEAR(chiSquare(counts, areas), 1, 0.15);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_LT(std::abs(samples.distances[i]), 1e-15);
    const auto [a, b, c] = cornersOf(mesh, mesh.triangles[samples.faces[i]]);
    const Vector3 normal = (b - a).cross(c - a).normalized();
    ASSERT_LT((samples.normals[i] - normal).norm(), 1e-15);
    ASSERT_LT((samples.gradients[i] - normal).norm(), 1e-12);
    ASSERT_LT((samples.closest[i] - samples.points[i]).norm(), 1e-15);
  }
}

TEST(SamplePoints, areUniformWithinEachTriangle) {
  const TriangleMesh mesh = {.vertices = {{0, 0, 0}, {4, 0, 1}, {0, 2, 0}}, .triangles = {{0, 1, 2}}, .name = {}};
  const ExactDistance distance(mesh, {.insideTest = InsideTest::shell, .thickness = 1e-3});
  const SamplePoints samples = samplePoints(mesh, distance, only(PointKind::surface, 100'000));
  std::vector<std::size_t> counts(16);  // of the similar triangles into which the sides' quarters divide it
  for (const Vector3& x : samples.points) {
    const Vector3 weights = distance.closestPoint(x).barycentric * 4;
    const std::array<int, 3> quarter = {int(weights[0]), int(weights[1]), int(weights[2])};
    const bool isTurned = quarter[0] + quarter[1] + quarter[2] == 2;
    ++counts[std::size_t(isTurned ? 10 + quarter[0] * (7 - quarter[0]) / 2 + quarter[1]
                                  : quarter[0] * (9 - quarter[0]) / 2 + quarter[1])];
  }
  EXPECT_THAT(counts, testing::Each(testing::Gt(5800u)));
  EXPECT_NEAR(chiSquare(counts, std::vector<double>(16, 1)), 1, 1);
}

TEST(SamplePoints, edgePointsAreUniformOnSharpEdges) {
  const TriangleMesh box = support::boxBetween({-1, -0.5, -0.25}, {1, 0.5, 0.25});
  const SamplePoints samples = samplesOf(box, only(PointKind::edge, 60'000));
  std::array<std::size_t, 3> along = {};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Vector3 share = samples.points[i].cwiseAbs().cwiseQuotient(Vector3(1, 0.5, 0.25));
    int least;
    share.minCoeff(&least);
    ++along[std::size_t(least)];
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_TRUE(axis == least || std::abs(share[axis] - 1) < 1e-15) << "not on an edge: " << share.transpose();
    EXPECT_NEAR(samples.distances[i], 0, 1e-15);
    EXPECT_NEAR(samples.normals[i].cwiseAbs()[least], 0, 1e-12)
        << "the normal is the mean of those of the edge's faces";
    EXPECT_NEAR(samples.normals[i].norm(), 1, 1e-12);
  }
  EXPECT_LT(chiSquare({along.begin(), along.end()}, {2, 1, 0.5}), 5);
}

TEST(SamplePoints, edgesAreSharpByTheirAngleOrAtABoundary) {
  const TriangleMesh ball = shapes::mesh("sphere");
  const ExactDistance distance(ball);
  SamplePointsOptions options = only(PointKind::edge, 10);
  try {
    samplePoints(ball, distance, options);
    ADD_FAILURE() << "a sphere has no sharp edges";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::StartsWith("edge: the surface has no edge at which faces meet at 30 degrees"));
    EXPECT_EQ(error.kind(), ErrorKind::option);
  }
  options.sharpAngleDegrees = 0;
  EXPECT_EQ(samplePoints(ball, distance, options).size(), 10u);
  options.sharpAngleDegrees = 30;
  const TriangleMesh open = support::openAbove(ball, 0.5);
  double highest = -1;
  for (const Triangle& triangle : open.triangles)
    for (const std::uint32_t v : triangle) highest = std::max(highest, open.vertices[v].z());
  for (const Vector3& x : samplesOf(open, options).points) EXPECT_NEAR(x.z(), highest, 0.2) << x.transpose();
}

TEST(SamplePoints, nearPointsHaveTheTwoWidths) {
  const TriangleMesh mesh = {
      .vertices = {{-300, -400, 0}, {300, -400, 0}, {0, 800, 0}}, .triangles = {{0, 1, 2}}, .name = {}};
  const ExactDistance distance(mesh, {.insideTest = InsideTest::winding});
  SamplePointsOptions options = only(PointKind::near, 100'000);
  options.widths = {0.01, 0.001};
  const SamplePoints samples = samplePoints(mesh, distance, options);
  // The center of the box is (0, 200, 0), and its radius √(300² + 600²).
  const double radius = std::sqrt(300.0 * 300 + 600.0 * 600);
  std::array<double, 2> squares = {}, fourth = {};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double z = samples.points[i].z();
    squares[i % 2] += z * z / 50'000;
    fourth[i % 2] += z * z * z * z / 50'000;
  }
  for (std::size_t n = 0; n < 2; ++n) {
    EXPECT_NEAR(std::sqrt(squares[n]) / (radius * options.widths[n]), 1, 0.02);
    EXPECT_NEAR(fourth[n] / (squares[n] * squares[n]), 3, 0.15) << "the kurtosis of a Gaussian is 3";
  }
}

TEST(SamplePoints, uniformPointsFillTheEnlargedBox) {
  const TriangleMesh mesh = support::boxBetween({0, 0, 0}, {4, 2, 1});
  SamplePointsOptions options = only(PointKind::uniform, 64'000);
  options.enlargement = 0.25;
  std::vector<std::size_t> counts(64);
  for (const Vector3& x : samplesOf(mesh, options).points) {
    const Vector3 share = (x - Vector3(-1, -1, -1)).cwiseQuotient(Vector3(6, 4, 3));
    ASSERT_GE(share.minCoeff(), 0);
    ASSERT_LT(share.maxCoeff(), 1);
    ++counts[std::size_t(share.x() * 4) + 4 * std::size_t(share.y() * 4) + 16 * std::size_t(share.z() * 4)];
  }
  EXPECT_NEAR(chiSquare(counts, std::vector<double>(64, 1)), 1, 0.7);
}

TEST(SamplePoints, haveTheSignsOfTheSumOverAllFaces) {
  for (const TriangleMesh& mesh :
       {shapes::mesh("gear"), support::openBox(),
        support::joined(support::boxOfTwo(), support::moved(shapes::mesh("torus"), {0.5, 0, 0}))}) {
    const SamplePoints samples = samplesOf(mesh, {.surface = 0, .near = 300, .uniform = 200, .floatPoints = true});
    std::size_t inside = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      for (const double coordinate : samples.points[i]) {
        const volatile float stored = float(coordinate);  // GCC 12 removes conversions that do not go through memory
        EXPECT_EQ(coordinate, double(stored));
      }
      const bool expected = support::windingByHand(mesh, samples.points[i]) > 0.5;
      ASSERT_EQ(samples.distances[i] < 0, expected) << samples.points[i].transpose();
      inside += expected;
    }
    EXPECT_GT(inside, 80u);
  }
}

TEST(SamplePoints, agreeWithSingleQueries) {
  const TriangleMesh mesh = shapes::mesh("gear");
  const ExactDistance distance(mesh);
  const SamplePoints samples = samplePoints(mesh, distance, {.surface = 300, .edge = 300, .near = 300, .uniform = 300});
  std::vector<double> values(samples.size());
  std::vector<Vector3> gradients(samples.size());
  distance.withGradients(samples.points, values, gradients);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const ClosestPoint closest = distance.closestPoint(samples.points[i]);
    EXPECT_EQ(samples.distances[i], closest.signedDistance);
    EXPECT_EQ(samples.closest[i], closest.point);
    EXPECT_EQ(samples.faces[i], closest.triangle);
    EXPECT_LT((samples.gradients[i] - gradients[i]).norm(), std::abs(values[i]) > 1e-6 ? 1e-9 : 3);
    EXPECT_EQ(samples.kinds[i], PointKind(i / 300));
  }
}

TEST(SamplePoints, haveNoGradientBesideAClosedHole) {
  const SamplePoints samples = samplesOf(support::openBox(), only(PointKind::uniform, 2000));
  std::size_t unknown = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double length = samples.gradients[i].norm();
    unknown += length == 0;
    EXPECT_TRUE(length == 0 || std::abs(length - 1) < 1e-12);
    EXPECT_TRUE(length == 0 ||
                std::abs(std::abs(samples.distances[i]) - (samples.points[i] - samples.closest[i]).norm()) < 1e-8);
  }
  EXPECT_GT(unknown, 50u);
  EXPECT_LT(unknown, 1000u);
}

TEST(SamplePoints, ofAnOuterHullLieOnTheHull) {
  const TriangleMesh mesh = support::joined(support::boxBetween({-1, -1, -1}, {0.5, 1, 1}),
                                            support::boxBetween({-0.4, -0.7, -0.6}, {1, 0.8, 0.7}));
  const ExactDistance hull(mesh, {.insideTest = InsideTest::outerHull});
  const SamplePoints samples = samplePoints(mesh, hull, only(PointKind::surface, 5000));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_NEAR(samples.distances[i], 0, 1e-12);
    ASSERT_LT(samples.faces[i], mesh.triangles.size());
    const Vector3& x = samples.points[i];
    const Vector3 margin = Vector3::Constant(1e-6);
    const Box both(Vector3(-0.4, -0.7, -0.6) + margin, Vector3(0.5, 0.8, 0.7) - margin);
    EXPECT_FALSE(both.contains(x)) << "a point on an inner wall: " << x.transpose();
  }
}

bool areEqual(const SamplePoints& one, const SamplePoints& other) {
  return one.points == other.points && one.distances == other.distances && one.gradients == other.gradients &&
         one.closest == other.closest && one.faces == other.faces && one.normals == other.normals &&
         one.kinds == other.kinds;
}

TEST(SamplePoints, dependOnTheSeedAndNotOnThreads) {
  const TriangleMesh mesh = shapes::mesh("gear");
  const ExactDistance distance(mesh);
  SamplePointsOptions options{.surface = 2000, .edge = 1000, .near = 2000, .uniform = 1000, .seed = 5, .threads = 1};
  const SamplePoints one = samplePoints(mesh, distance, options);
  for (const int threads : {2, 5}) {
    options.threads = threads;
    EXPECT_TRUE(areEqual(samplePoints(mesh, distance, options), one)) << threads;
  }
  options.seed = 6;
  const SamplePoints other = samplePoints(mesh, distance, options);
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_NE(one.points[i], other.points[i]);
  options.seed = 5;
  options.surface = 10;  // other counts change no point of the other kinds
  const SamplePoints fewer = samplePoints(mesh, distance, options);
  EXPECT_TRUE(std::equal(fewer.points.begin() + 10, fewer.points.end(), one.points.begin() + 2000));
}

TEST(SamplePoints, ofAFieldAreItsValues) {
  const TriangleMesh mesh = shapes::mesh("torus");
  const Field field = build(ExactDistance(mesh), domainAround(mesh), {.targetError = 1e-4});
  const SamplePoints samples = samplePoints(mesh, field, {.surface = 500, .near = 500, .uniform = 500});
  EXPECT_TRUE(samples.closest.empty() && samples.faces.empty() && samples.normals.empty());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto [value, gradient] = field.valueAndGradient(samples.points[i]);
    EXPECT_EQ(samples.distances[i], value);
    EXPECT_EQ(samples.gradients[i], gradient);
  }
}

TEST(SamplePoints, ofAFieldAreDrawnOnItsContourWithinTheDomain) {
  const Box domain(Vector3::Constant(-1), Vector3::Constant(1));
  const Field plane = build([](const Vector3& x) { return x.z() - 0.1; }, domain, {.targetError = 1e-6});
  const SamplePoints samples = samplePoints(plane, only(PointKind::surface, 1000));
  for (const Vector3& point : samples.points) EXPECT_NEAR(point.z(), 0.1, 1e-3) << "not on a wall of the domain";
  for (const double level : {-5.0, 5.0}) {
    const Field everywhere = build([&](const Vector3& x) { return x.z() - level; }, domain, {.targetError = 1e-6});
    EXPECT_THROW(samplePoints(everywhere, only(PointKind::surface, 10)), Error);
  }
}

TEST(SamplePoints, refuseOptionsOutOfRange) {
  const TriangleMesh mesh = support::boxOfTwo();
  const ExactDistance distance(mesh);
  const auto refusal = [&](const SamplePointsOptions& options) {
    try {
      samplePoints(mesh, distance, options);
      return std::string("accepted");
    } catch (const Error& error) {
      return std::string(error.what());
    }
  };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_THAT(refusal({.widths = {0.1, kInfinity}}), testing::StartsWith("widths: must be finite numbers above 0"));
  EXPECT_THAT(refusal({.widths = {std::nan(""), 0.1}}), testing::StartsWith("widths: "));
  EXPECT_THAT(refusal({.widths = {0, 0.1}}), testing::StartsWith("widths: "));
  EXPECT_THAT(refusal({.sharpAngleDegrees = 181}), testing::StartsWith("sharp angle: "));
  EXPECT_THAT(refusal({.enlargement = -0.1}), testing::StartsWith("enlargement: "));
  EXPECT_THAT(refusal(kNone), testing::StartsWith("samples: no points are asked for"));
  EXPECT_THAT(refusal({.surface = 1'000'000'000'000'000}), testing::HasSubstr("would take some"));
  EXPECT_THAT(refusal({.surface = std::numeric_limits<std::size_t>::max()}),
              testing::HasSubstr("ask for fewer points"));
  EXPECT_THAT(refusal({.widths = {1e101, 1e308}}), testing::HasSubstr("exceed 1e100"));
  EXPECT_THAT(refusal({.widths = {1e38, 1e38}, .floatPoints = true}),
              testing::HasSubstr("exceed the range of single precision"));
  EXPECT_THROW(samplePoints(shapes::mesh("gear"), distance), Error) << "another mesh";
  EXPECT_THROW(samplePoints(mesh, distance, {}, {.cancelled = [] { return true; }}), Cancelled);
}

// --- Files

std::string bytesOf(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The content of an array in a .npz file: its header, and its bytes.
struct ParsedArray {
  std::string header, bytes;

  template <typename T>
  std::vector<T> numbers() const {
    std::vector<T> values(bytes.size() / sizeof(T));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }
};

/// Parses a .npz file with stored entries, by the headers in front of its files.
std::map<std::string, ParsedArray> parsedNpz(const std::string& npz) {
  const auto number = [&](std::size_t at, int size) {
    std::size_t value = 0;
    for (int i = size; i-- > 0;) value = value << 8 | static_cast<unsigned char>(npz.at(at + std::size_t(i)));
    return value;
  };
  std::map<std::string, ParsedArray> arrays;
  for (std::size_t at = 0; number(at, 4) == 0x04034b50;) {
    const std::size_t size = number(at + 18, 4), nameSize = number(at + 26, 2), start = at + 30 + nameSize;
    const std::size_t headerSize = number(start + 8, 2);
    arrays[npz.substr(at + 30, nameSize)] = {npz.substr(start + 10, headerSize),
                                             npz.substr(start + 10 + headerSize, size - 10 - headerSize)};
    at = start + size;
  }
  return arrays;
}

struct SampleFiles : testing::Test {
  SampleFiles() : mesh(shapes::mesh("gear")) {
    samples = samplePoints(mesh, ExactDistance(mesh),
                           {.surface = 50, .edge = 50, .near = 10'000, .uniform = 100, .floatPoints = true});
  }

  std::filesystem::path at(const std::string& name) const { return folder / name; }

  support::TemporaryDirectory folder;
  TriangleMesh mesh;
  SamplePoints samples;
};

TEST_F(SampleFiles, npzHasTheArraysWithTheirShapes) {
  saveSamples(samples, at("s.npz"));
  auto arrays = parsedNpz(bytesOf(at("s.npz")));
  ASSERT_EQ(arrays.size(), 7u);
  const auto expectShape = [&](const std::string& name, const std::string& type, const std::string& shape) {
    EXPECT_THAT(arrays.at(name + ".npy").header,
                testing::StartsWith("{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + shape + "), }"));
  };
  for (const char* name : {"points", "gradients", "closest", "normals"}) expectShape(name, "<f4", "10200, 3");
  expectShape("distances", "<f4", "10200,");
  expectShape("faces", "<i4", "10200,");
  expectShape("kinds", "|u1", "10200,");
  const auto points = arrays.at("points.npy").numbers<float>();
  const auto distances = arrays.at("distances.npy").numbers<float>();
  const auto faces = arrays.at("faces.npy").numbers<std::int32_t>();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_EQ(points[3 * i + axis], samples.points[i][int(axis)]);
    EXPECT_EQ(distances[i], float(samples.distances[i]));
    EXPECT_EQ(faces[i], std::int32_t(samples.faces[i]));
  }
  saveSamples(samples, at("double.npz"), {.doubles = true});
  arrays = parsedNpz(bytesOf(at("double.npz")));
  expectShape("points", "<f8", "10200, 3");
  EXPECT_EQ(arrays.at("distances.npy").numbers<double>(), samples.distances);
}

TEST_F(SampleFiles, deepSdfsLayoutDividesPointsBySign) {
  saveSamples(samples, at("s.npz"), {.layout = SampleLayout::deepSdf});
  const auto arrays = parsedNpz(bytesOf(at("s.npz")));
  ASSERT_EQ(arrays.size(), 2u);
  std::size_t rows = 0;
  for (const bool positive : {true, false}) {
    const auto numbers = arrays.at(positive ? "pos.npy" : "neg.npy").numbers<float>();
    std::size_t row = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if ((samples.distances[i] > 0) != positive) continue;
      EXPECT_EQ(numbers.at(4 * row), float(samples.points[i].x()));
      EXPECT_EQ(numbers.at(4 * row + 3), float(samples.distances[i]));
      ++row;
    }
    EXPECT_EQ(numbers.size(), 4 * row);
    EXPECT_GT(row, 1000u);
    rows += row;
  }
  EXPECT_EQ(rows, samples.size());
}

TEST_F(SampleFiles, plyIsReadAsAMeshOfVertices) {
  saveSamples(samples, at("s.ply"));
  const std::string ply = bytesOf(at("s.ply"));
  const std::size_t start = ply.find("end_header\n") + 11;
  EXPECT_EQ(ply.size() - start, samples.size() * (14 * sizeof(float) + 1 + 4 - sizeof(float)));
  EXPECT_THAT(ply, testing::HasSubstr("element vertex 10200\nproperty float x\n"));
  const std::size_t row = (ply.size() - start) / samples.size(), last = start + row * (samples.size() - 1);
  float x;
  std::int32_t face;
  std::memcpy(&x, ply.data() + last, sizeof(x));
  std::memcpy(&face, ply.data() + last + 7 * 4 + 1 + 3 * 4, sizeof(face));
  EXPECT_EQ(x, samples.points.back().x());
  EXPECT_EQ(face, std::int32_t(samples.faces.back()));
}

TEST_F(SampleFiles, csvIsReadBackWithTheSameNumbers) {
  saveSamples(samples, at("s.csv"), {.doubles = true});
  std::istringstream lines(bytesOf(at("s.csv")));
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  EXPECT_EQ(line, "x,y,z,distance,gx,gy,gz,kind,px,py,pz,face,nx,ny,nz");
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_TRUE(std::getline(lines, line));
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream numbers(line);
    std::array<double, 15> row;
    for (double& number : row) ASSERT_TRUE(numbers >> number) << line;
    EXPECT_EQ(row[0], samples.points[i].x());
    EXPECT_EQ(row[3], samples.distances[i]);
    EXPECT_EQ(row[6], samples.gradients[i].z());
    EXPECT_EQ(row[7], double(samples.kinds[i]));
    EXPECT_EQ(row[10], samples.closest[i].z());
    EXPECT_EQ(row[11], samples.faces[i]);
    EXPECT_EQ(row[14], samples.normals[i].z());
  }
  EXPECT_FALSE(std::getline(lines, line));
}

TEST_F(SampleFiles, areWrittenWholeOrNotAtAll) {
  EXPECT_THROW(saveSamples(samples, at("s.txt")), Error);
  EXPECT_THROW(checkSamplesWritable(at("s")), Error);
  EXPECT_THROW(checkSamplesWritable(at("s.ply"), {.layout = SampleLayout::deepSdf}), Error);
  EXPECT_THROW(checkSamplesWritable(at("none/s.npz")), Error);
  EXPECT_TRUE(std::filesystem::is_empty(at("")));
}

}  // namespace sample_points_test
}  // namespace hpsdf
