// Tests grid_distance.h: interpolation of samples on grids, and the readers of VTK's and NumPy's files.
#include "hpsdf/input/grid_distance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "grids/read_grid.h"
#include "hpsdf/build.h"
#include "hpsdf/shapes.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace grid_distance_test {

/// Returns a grid of the values of a function.
template <typename Function>
RegularGrid gridOf(const GridLayout& layout, const Function& function) {
  RegularGrid grid{.layout = layout, .values = {}, .gradients = {}};
  for (std::size_t k = 0; k < layout.points[2]; ++k)
    for (std::size_t j = 0; j < layout.points[1]; ++j)
      for (std::size_t i = 0; i < layout.points[0]; ++i) grid.values.push_back(function(layout.position(i, j, k)));
  return grid;
}

const GridLayout kLayout = {.points = {13, 9, 22}, .origin = Vector3(-1, -0.5, 2), .spacing = Vector3(0.1, 0.2, 0.05)};

std::vector<Vector3> randomPoints(const Box& box, std::size_t count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Vector3> points(count);
  for (Vector3& x : points)
    x = box.min() + Vector3(uniform(random), uniform(random), uniform(random)).cwiseProduct(box.sizes());
  return points;
}

std::vector<double> valuesOf(const GridDistance& distance, const std::vector<Vector3>& points) {
  std::vector<double> values(points.size());
  distance(points, values);
  return values;
}

double quadratic(const Vector3& x) { return x.x() * x.x() - 2 * x.y() * x.z() + 0.5 * x.z() * x.z() + x.y() - 1.1; }
Vector3 gradientOfQuadratic(const Vector3& x) { return {2 * x.x(), -2 * x.z() + 1, -2 * x.y() + x.z()}; }

TEST(GridDistance, fingerprintsTellPlacesAndValuesApart) {
  const auto fingerprintOf = [](const GridLayout& layout, double radius) {
    RegularGrid grid = gridOf(kLayout, [&](const Vector3& x) { return (x - kLayout.box().center()).norm() - radius; });
    grid.layout = layout;
    return GridDistance(grid).source().fingerprint;
  };
  GridLayout moved = kLayout, scaled = kLayout;
  moved.origin += Vector3(5, 0, 0);
  scaled.spacing *= 2;
  const std::uint64_t before = fingerprintOf(kLayout, 0.3);
  EXPECT_EQ(fingerprintOf(kLayout, 0.3), before);
  EXPECT_NE(fingerprintOf(kLayout, 0.31), before);
  EXPECT_NE(fingerprintOf(moved, 0.3), before);
  EXPECT_NE(fingerprintOf(scaled, 0.3), before);
}

TEST(GridDistance, reproducesQuadraticPolynomialsUpToTheBoundary) {
  const GridDistance distance(gridOf(kLayout, quadratic));
  const std::vector<Vector3> points = randomPoints(kLayout.box(), 1000);
  std::vector<double> values(points.size());
  std::vector<Vector3> gradients(points.size());
  distance.withGradients(points, values, gradients);
  EXPECT_EQ(values, valuesOf(distance, points));
  for (std::size_t n = 0; n < points.size(); ++n) {
    EXPECT_NEAR(values[n], quadratic(points[n]), 1e-12);
    EXPECT_LT((gradients[n] - gradientOfQuadratic(points[n])).norm(), 1e-11);
  }
  const std::vector<Vector3> corners = {kLayout.box().min(), kLayout.box().max()};
  EXPECT_NEAR(valuesOf(distance, corners)[1], quadratic(corners[1]), 1e-12);
}

TEST(GridDistance, isContinuedBeyondItsBox) {
  const GridDistance distance(gridOf(kLayout, quadratic));
  const Vector3 inside(-0.5, 0.1, 2.3), outside(-0.5, 0.1, kLayout.box().max().z() + 0.7);
  const Vector3 wall(-0.5, 0.1, kLayout.box().max().z());
  std::vector<double> values(3);
  std::vector<Vector3> gradients(3);
  distance.withGradients(std::vector<Vector3>{inside, outside, wall}, values, gradients);
  EXPECT_NEAR(values[1], values[2] + 0.7, 1e-12);
  EXPECT_NEAR(gradients[1].z(), 1, 1e-12);
  EXPECT_NEAR(gradients[1].x(), gradients[2].x(), 1e-12);
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(std::isfinite(valuesOf(distance, {Vector3(infinity, 0, 0)})[0]));
}

TEST(GridDistance, knowsItsSurfaceAndItsLikelyError) {
  const auto sphere = [](const Vector3& x) { return x.norm() - 0.7; };
  const auto errorOf = [&](std::uint32_t points) {
    const GridLayout layout = gridOfCells(Box(Vector3::Constant(-1), Vector3::Constant(1)), {points, points, points});
    const GridDistance distance(gridOf(layout, sphere), {.name = "sphere.npy"});
    EXPECT_EQ(distance.source().name, "sphere.npy");
    EXPECT_TRUE(distance.source().box.isApprox(Box(Vector3::Constant(-0.7), Vector3::Constant(0.7)), 0.01));
    const InterpolationError likely = distance.interpolationError();
    double worst = 0;
    for (const Vector3& x : randomPoints(layout.box(), 20000))
      if (std::abs(sphere(x)) < 0.1) worst = std::max(worst, std::abs(valuesOf(distance, {x})[0] - sphere(x)));
    EXPECT_GT(likely.samples, 100u);
    EXPECT_LE(worst, likely.max) << points;
    return likely.rms;
  };
  EXPECT_LT(errorOf(40), errorOf(20) / 6) << "of the third order or better";
}

TEST(GridDistance, takesAnotherDistanceWhereSamplesAreMissing) {
  const auto sphere = [](const Vector3& x) { return x.norm() - 0.7; };
  SampledBlocks samples{.origin = Vector3::Zero(), .spacing = Vector3::Constant(0.1), .blocks = {}};
  for (const std::int32_t a : {-1, 0}) {
    SampledBlocks::Block block{.index = {a, 0, 0}, .values = {}};
    for (int n = 0; n < 512; ++n) {
      const Vector3 x = 0.1 * Vector3(8 * a + n % 8, n / 8 % 8, n / 64);
      block.values[n] = n == 511 ? std::nan("") : sphere(x);
    }
    samples.blocks.push_back(block);
  }
  const GridDistance distance(samples, DistanceFunction([](const Vector3&) { return 42.0; }));
  EXPECT_FALSE(distance.hasGradients()) << "the other distance has none";
  EXPECT_NEAR(valuesOf(distance, {Vector3(0.05, 0.35, 0.35)})[0], sphere(Vector3(0.05, 0.35, 0.35)), 1e-3);
  EXPECT_EQ(valuesOf(distance, {Vector3(0.05, 0.05, 0.35)})[0], 42) << "too close to the boundary of the blocks";
  EXPECT_EQ(valuesOf(distance, {Vector3(0.55, 0.55, 0.55)})[0], 42) << "beside the missing sample";
  EXPECT_EQ(valuesOf(distance, {Vector3(1e300, 0, 0)})[0], 42);
}

TEST(GridDistance, passesContinuouslyIntoTheOtherDistance) {
  const auto sphere = [](const Vector3& x) { return x.norm() - 0.3; };
  SampledBlocks samples{.origin = Vector3::Zero(), .spacing = Vector3(0.05, 0.06, 0.055), .blocks = {}};
  for (std::int32_t b = 0; b < 64; ++b) {
    SampledBlocks::Block block{.index = {b % 4 - 2, b / 4 % 4 - 2, b / 16 - 2}, .values = {}};
    for (int n = 0; n < 512; ++n) {
      const Vector3 index(8 * block.index[0] + n % 8, 8 * block.index[1] + n / 8 % 8, 8 * block.index[2] + n / 64);
      const double value = sphere(index.cwiseProduct(samples.spacing));
      block.values[n] = std::abs(value) < 0.25 ? value : std::nan("");
    }
    samples.blocks.push_back(block);
  }
  struct Other {
    void operator()(std::span<const Vector3> points, std::span<double> out) const {
      for (std::size_t i = 0; i < points.size(); ++i) out[i] = points[i].norm() - 0.2;
    }
    bool hasGradients() const { return true; }
    void withGradients(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> gradients) const {
      (*this)(points, out);
      for (std::size_t i = 0; i < points.size(); ++i) gradients[i] = points[i].normalized();
    }
  };
  const GridDistance distance(samples, DistanceFunction(Other()));
  // From the sphere outward, the distance passes from that of the samples to the other one, which is greater by 0.1.
  constexpr double kStep = 1e-4;
  int mixed = 0;
  for (const Vector3& to : randomPoints(Box(Vector3::Constant(-1), Vector3::Constant(1)), 50)) {
    std::vector<Vector3> points;
    for (double r = 0.29; r < 0.8; r += kStep) points.push_back(r * to.normalized());
    std::vector<double> values(points.size());
    std::vector<Vector3> gradients(points.size());
    distance.withGradients(points, values, gradients);
    EXPECT_EQ(values, valuesOf(distance, points));
    EXPECT_NEAR(values.front(), -0.01, 0.01);
    EXPECT_NEAR(values.back(), 0.6, 0.01);
    for (std::size_t i = 1; i < points.size(); ++i) {
      ASSERT_NEAR(values[i] - values[i - 1], kStep, 5 * kStep);
      const double share = (points[i].norm() - 0.2) - values[i];
      if (share < 0.01 || share > 0.09) continue;
      ++mixed;
      constexpr double kLittle = 1e-7;
      const Vector3 step = kLittle * to.normalized();
      const std::vector<double> beside = valuesOf(distance, {points[i] - step, points[i] + step});
      EXPECT_NEAR(gradients[i].dot(to.normalized()), (beside[1] - beside[0]) / (2 * kLittle), 1e-3) << i;
    }
  }
  EXPECT_GT(mixed, 1000);
}

TEST(GridDistance, refusesGridsWithoutSurfaceOrWithBadNumbers) {
  EXPECT_THROW(GridDistance(gridOf(kLayout, [](const Vector3&) { return 1.0; })), Error);
  EXPECT_THROW(GridDistance(gridOf(kLayout, [](const Vector3& x) { return x.x() > 0 ? std::nan("") : -1.0; })), Error);
  EXPECT_THROW(GridDistance(gridOf({.points = {3, 9, 9}}, quadratic)), Error);
  const auto refusal = [](const RegularGrid& grid) -> std::string {
    try {
      const GridDistance distance(grid);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  };
  RegularGrid grid = gridOf(kLayout, quadratic);
  grid.values[7] = 1e160;
  EXPECT_THAT(refusal(grid), testing::HasSubstr("the value number 8 of the grid is not a finite number up to 1e100"));
  grid.values[7] = 1;
  grid.values.pop_back();
  EXPECT_THAT(refusal(grid), testing::HasSubstr("with 2573 values"));
  EXPECT_THAT(refusal({.layout = {.points = {4, 4, 8'388'609}}, .values = {}, .gradients = {}}),
              testing::HasSubstr("from 1 to 8388608"));
  EXPECT_THAT(refusal({.layout = {.points = {8'000'000, 8'000'000, 4}}, .values = {}, .gradients = {}}),
              testing::HasSubstr("take a grid with larger voxels"));
  GridLayout far = kLayout;
  far.origin.x() = 1e13;
  EXPECT_THAT(refusal(gridOf(far, [](const Vector3& x) { return x.y(); })),
              testing::HasSubstr("that rounding spoils its spacing"));
  SampledBlocks samples{.blocks = {{.index = {1 << 20, 0, 0}, .values = {}}}};
  EXPECT_THROW(GridDistance(samples, DistanceFunction([](const Vector3&) { return 1.0; })), Error);
}

TEST(GridDistance, becomesAField) {
  const DistanceFunction torus = shapes::analytic("analytic:torus");
  const GridLayout layout = gridOfCells(domainAround(torus.source().box), {60, 60, 60});
  const GridDistance distance(gridOf(layout, [&](const Vector3& x) {
    double value = 0;
    torus({&x, 1}, {&value, 1});
    return value;
  }));
  const Field field = build(distance, layout.box(), {.targetError = 1e-6});
  for (const Vector3& x : randomPoints(layout.box(), 1000)) {
    double expected = 0;
    torus({&x, 1}, {&expected, 1});
    EXPECT_NEAR(field.value(x), expected, std::abs(expected) < 0.1 ? 0.02 : 0.2);
  }
}

class GridFiles : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  std::string bytesOf(const std::filesystem::path& file) const {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  std::filesystem::path save(const std::string& name, const RegularGrid& grid, NumberType type) const {
    OutputFile out(folder_ / name);
    name.ends_with("vti") ? writeVti(grid, type, out) : writeNpy(grid, type, out);
    out.commit();
    return folder_ / name;
  }
  void expectRefused(const std::string& name, const std::string& bytes, const std::string& message) const {
    const std::filesystem::path file = write(name, bytes);
    try {
      loadGrid(file);
      ADD_FAILURE() << "read: " << message;
    } catch (const Error& error) {
      EXPECT_EQ(error.subject(), file.string());
      EXPECT_THAT(error.what(), testing::HasSubstr(message));
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }

  support::TemporaryDirectory folder_;
};

TEST_F(GridFiles, areReadAsTheyWereWritten) {
  RegularGrid grid = gridOf(kLayout, quadratic);
  for (const bool withGradients : {false, true}) {
    if (withGradients) grid.gradients.assign(grid.values.size(), Vector3(1, 2, 3));
    const RegularGrid vti = loadGrid(save("grid.vti", grid, NumberType::float64));
    EXPECT_EQ(vti.layout.points, kLayout.points);
    EXPECT_EQ(vti.layout.origin, kLayout.origin);
    EXPECT_EQ(vti.layout.spacing, kLayout.spacing);
    EXPECT_EQ(vti.values, grid.values);
    const RegularGrid npy = loadGrid(save("grid.npy", grid, NumberType::float64));
    EXPECT_EQ(npy.layout.points, kLayout.points);
    EXPECT_EQ(npy.layout.spacing, Vector3::Ones());
    EXPECT_EQ(npy.values, grid.values);
    EXPECT_EQ(loadGrid(save("grid.vti", grid, NumberType::float32)).values[9], double(float(grid.values[9])));
    EXPECT_EQ(loadGrid(save("grid.npy", grid, NumberType::float32)).values[9], double(float(grid.values[9])));
  }
}

/// Returns a file of VTK with the values 0, 1, … at 2 × 2 × 1 points in one data array.
std::string imageOf(const std::string& attributes, const std::string& array, const std::string& appended = "") {
  return "<?xml version='1.0'?>\n<VTKFile type=\"ImageData\" " + attributes +
         ">\n<!-- comment --><ImageData WholeExtent=\"1 2 0 1 0 0\" Origin=\"0 0 5\" Spacing=\"2 1 1\">"
         "<Piece Extent=\"1 2 0 1 0 0\">\n<PointData>" +
         array + "</PointData><CellData></CellData></Piece></ImageData>\n" + appended + "</VTKFile>\n";
}

TEST_F(GridFiles, ofVtkAreReadInItsOtherEncodings) {
  const std::string name = "<DataArray type=\"Float32\" Name=\"d\" ";
  // The sixteen bytes of the floats 0, 1, 2, 3, behind their size in 32 bits.
  const std::string before = "<!-- <DataArray type='Int8'> > --><![CDATA[<DataArray type='Int8'>]]>";
  const std::string base64 = "EAAAAAAAAAAAAIA/AAAAQAAAQEA=", separate = "EAAAAA==AAAAAAAAgD8AAABAAABAQA==";
  const std::vector<std::string> files = {
      imageOf("", name + "format=\"ascii\">\n 0 1\n2 3 </DataArray>"),
      imageOf("", before + name + "format=\"ascii\">0 1 2 3</DataArray><!-- a > b -->"),
      imageOf("byte_order='LittleEndian'", name + "format=\"binary\">\n  " + base64 + "\n</DataArray>"),
      imageOf("", name + "format=\"binary\">" + separate + "</DataArray>"),
      imageOf("", name + "format=\"appended\" offset=\"4\"/>",
              "<AppendedData encoding=\"base64\">_AAAA" + base64 + "</AppendedData>"),
      imageOf("", name + "format=\"appended\" offset=\"0\"/>",
              "<AppendedData encoding=\"raw\">\n_" +
                  std::string("\x10\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\x40\0\0\x40\x40", 20) + "</AppendedData>")};
  for (const std::string& file : files) {
    SCOPED_TRACE(file);
    const RegularGrid grid = loadGrid(write("grid.vti", file));
    EXPECT_THAT(grid.values, testing::ElementsAre(0, 1, 2, 3));
    EXPECT_EQ(grid.layout.origin, Vector3(2, 0, 5)) << "the first index is 1";
  }
}

TEST_F(GridFiles, ofVtkAreRefusedIfTheyAreForeign) {
  const std::string array = "<DataArray type=\"Float32\" Name=\"d\" format=\"ascii\">0 1 2 3</DataArray>";
  expectRefused("a.vti", "solid", "no file of VTK");
  expectRefused("a.vti", "<VTKFile type=\"PolyData\">", "expected ImageData");
  expectRefused("a.vti", imageOf("byte_order=\"BigEndian\"", array), "big-endian");
  expectRefused("a.vti", imageOf("compressor=\"vtkLZ4DataCompressor\"", array), "vtkLZ4DataCompressor");
  expectRefused("a.vti", imageOf("", ""), "no array of single numbers");
  expectRefused("a.vti", imageOf("", array + array), "several arrays");
  expectRefused("a.vti", imageOf("", "<DataArray type=\"Int8\" Name=\"d\" format=\"ascii\">0</DataArray>"), "Int8");
  expectRefused("a.vti", imageOf("", "<DataArray type=\"Float32\" Name=\"d\" format=\"ascii\">0 1 2</DataArray>"),
                "4 finite numbers");
  expectRefused("a.vti", imageOf("", "<DataArray type=\"Float32\" format=\"appended\" offset=\"0\"/>"),
                "behind the end");
  expectRefused("a.vti", imageOf("", "<DataArray type=\"Float32\" format=\"binary\">EAAA</DataArray>"), "ends within");
  const auto withExtent = [&](const std::string& extent) {
    std::string image = imageOf("", array);
    return image.replace(image.find("1 2 0 1 0 0"), 11, extent);
  };
  expectRefused("a.vti", withExtent("0.5 1.5 0 1 0 0"), "expected whole numbers of 32 bits as WholeExtent of the grid");
  expectRefused("a.vti", withExtent("4294967296 4294967297 0 1 0 0"), "expected whole numbers of 32 bits");
  expectRefused("a.vti", withExtent("1e300 1e300 0 1 0 0"), "expected whole numbers of 32 bits");
  expectRefused("a.vti", withExtent("0 9000000 0 1 0 0"), "expected from 1 to 8388608 points along each axis");
  expectRefused("a.vti", withExtent("2 1 0 1 0 0"), "a grid of 0 x 2 x 1 points");
  expectRefused("a.vti", withExtent("0 1 0 1"), "expected 6 numbers as WholeExtent of the grid, found '0 1 0 1'");
  expectRefused("a.vti", imageOf("compressor=\"" + std::string(1'000'000, 'x') + "\n\"", array),
                "compressed by '" + std::string(40, 'x') + "…'; expected");
  expectRefused("a.vti", imageOf("a", array), "=\"…\" in <VTKFile>");
  expectRefused("a.vti", "<VTKFile type=\"ImageData\"><!-- the rest of the file", "the file ends before '-->'");
  expectRefused("a.vti", "<VTKFile type=\"ImageData", "in <VTKFile>");
  std::string many = "<VTKFile ";
  for (int n = 0; n < 200; ++n) many += "a" + std::to_string(n) + "='' ";
  expectRefused("a.vti", many + ">", "more than 100 attributes");
  std::string vast = imageOf("", array);
  vast.replace(vast.find("1 2 0 1 0 0"), 11, "0 7999999 0 7999999 0 7999999");
  expectRefused("a.vti", vast, "a grid of 8000000 x 8000000 x 8000000 points would take some");
}

TEST_F(GridFiles, ofNumPyAreRefusedIfTheyAreForeign) {
  const auto npy = [](const std::string& header) {
    return std::string("\x93NUMPY\x01\x00", 8) + char(header.size()) + '\0' + header + std::string(64, '\0');
  };
  expectRefused("a.npy", "solid", "no array of NumPy");
  expectRefused("a.npy", npy("{'descr': '>f4', 'fortran_order': False, 'shape': (2, 2, 2), }"), ">f4");
  expectRefused("a.npy", npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2), }"), "2 axes");
  expectRefused("a.npy", npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, 2, 3), }"), "(nz, ny, nx, 4)");
  expectRefused("a.npy", npy("{'descr': '<f8', 'fortran_order': False, 'shape': (3, 3, 3), }"), "last number");
  expectRefused("a.npy", npy("{'descr': '<f8', 'fortran_order': False, 'shape': (x, 3, 3), }"), "damaged");
  expectRefused("a.npy", npy("{'descr': '<f8', 'fortran_order': False, 'shape': (999999999999, 3, 3), }"),
                "from 1 to 8388608");
  expectRefused("a.npy", npy("{'descr': '<f8', 'fortran_order': False, 'shape': (9999999, 0, 3), }"),
                "from 1 to 8388608");
  expectRefused("a.npy", npy("{'descr': '<f8', 'fortran_order': False, 'shape': (999999, 999999, 3), }"),
                "take a grid with larger voxels");
  expectRefused("a.npy", "", "the file is empty; export it again");
  expectRefused("a.npy", npy("{'descr': '<f8', 'fortran_order': False}"), "no 'shape'");
  const std::string fortran = npy("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 2, 2), }");
  EXPECT_EQ(loadGrid(write("b.npy", fortran)).values.size(), 8u);
}

TEST_F(GridFiles, thatAreDamagedAreReadOrRefused) {
  const RegularGrid grid = gridOf({.points = {7, 6, 5}, .origin = {}, .spacing = Vector3::Ones()}, quadratic);
  for (const std::string name : {"grid.vti", "grid.npy"}) {
    const std::string whole = bytesOf(save(name, grid, NumberType::float32));
    std::mt19937 random(3);
    for (int n = 0; n < 2000; ++n) {
      std::string bytes = whole;
      if (n % 4 == 0) bytes.resize(random() % bytes.size());
      for (std::uint32_t changes = random() % 4; changes > 0 && !bytes.empty(); --changes)
        bytes[random() % bytes.size()] = char(random());
      try {
        name == "grid.vti" ? grids::readVti(bytes) : grids::readNpy(bytes);
      } catch (const Error& error) {
        EXPECT_STRNE(error.what(), "");
      }
    }
  }
}

}  // namespace grid_distance_test
}  // namespace hpsdf
