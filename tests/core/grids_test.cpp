// Tests grids.h: regular grids of fields, and the files of VTK and NumPy, which are read back here by other code than
// that of the library.
#include "hpsdf/output/grids.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/jumps.h"
#include "hpsdf/shapes.h"
#include "support/one_leaf_field.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace grids_test {

/// Returns the bytes of the file that `write` writes.
std::string fileOf(const std::function<void(OutputFile&)>& write) {
  const support::TemporaryDirectory folder;
  OutputFile out(folder / "grid");
  write(out);
  out.commit();
  std::ifstream stream(folder / "grid", std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Returns the text between `before` and `after`, where `before` occurs for the first time.
std::string textBetween(const std::string& text, const std::string& before, const std::string& after) {
  const std::size_t begin = text.find(before);
  if (begin == std::string::npos) return "";
  return text.substr(begin + before.size(), text.find(after, begin + before.size()) - begin - before.size());
}

/// Returns the numbers of an array of a file of VTK, whose arrays are appended to it and compressed.
template <typename Number>
std::vector<Number> arrayOf(const std::string& file, const std::string& name) {
  const std::string element = textBetween(file, "Name=\"" + name + "\"", ">");
  const char* at = file.data() + file.find("\n_") + 2 + std::stoull(textBetween(element, "offset=\"", "\""));
  const auto next = [&at] {
    std::uint64_t value = 0;
    std::memcpy(&value, at, sizeof(value));
    at += sizeof(value);
    return value;
  };
  const std::uint64_t blocks = next(), bytesOfBlock = next(), bytesOfLast = next();
  std::vector<std::uint64_t> compressed(blocks);
  for (std::uint64_t& size : compressed) size = next();
  std::string bytes;
  for (const std::uint64_t size : compressed) {
    std::string block(bytesOfBlock, '\0');
    uLongf length = block.size();
    EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(block.data()), &length, reinterpret_cast<const Bytef*>(at), size),
              Z_OK);
    at += size;
    bytes += block.substr(0, length);
  }
  EXPECT_EQ(bytes.size() % bytesOfBlock, bytesOfLast);
  std::vector<Number> numbers(bytes.size() / sizeof(Number));
  std::memcpy(numbers.data(), bytes.data(), bytes.size());
  return numbers;
}

const Field& torus() {
  static const Field field = [] {
    const DistanceFunction distance = shapes::analytic("analytic:torus");
    return build(distance, domainAround(distance.source().box), {.targetError = 1e-5});
  }();
  return field;
}

TEST(Grids, layoutsCoverTheDomainByCellsOrByMultiplesOfVoxels) {
  const Box box(Vector3(-1, 0, 2), Vector3(1, 1, 2.5));
  const GridLayout cells = gridOfCells(box, {4, 2, 1});
  EXPECT_EQ(cells.points, (std::array<std::uint32_t, 3>{5, 3, 2}));
  EXPECT_EQ(cells.position(4, 2, 1), box.max());
  EXPECT_EQ(cells.box().min(), box.min());
  const GridLayout voxels = gridOfVoxels(box, 0.3);
  EXPECT_EQ(voxels.points, (std::array<std::uint32_t, 3>{7, 4, 2}));
  EXPECT_TRUE(voxels.origin.isApprox(Vector3(-0.9, 0, 2.1), 1e-15));
  EXPECT_THROW(gridOfVoxels(box, 0), Error);
  EXPECT_THROW(gridOfVoxels(box, std::nan("")), Error);
  EXPECT_THROW(gridOfVoxels(Box(Vector3::Constant(0.1), Vector3::Constant(0.2)), 1), Error);
}

TEST(Grids, refuseMorePointsThanMemoryHolds) {
  const Box far(Vector3::Constant(1), Vector3::Constant(2));
  for (const Box& box : {torus().domain(), far})
    for (const double voxel : {1e-7, 1e-12, 1e-300, 1e-320}) {
      try {
        gridOfVoxels(box, voxel);
        FAIL();
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), voxel == 1e-7 ? ErrorKind::limit : ErrorKind::option) << error.what();
        EXPECT_EQ(std::string(error.what()).find("inf"), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find("give larger voxels"), std::string::npos) << error.what();
      }
    }
  EXPECT_THROW(sampleGrid(torus(), {.points = {4000000000u, 4000000000u, 4000000000u}}, true), Error);
}

TEST(Grids, samplesAreTheFieldsValuesForAnyNumberOfThreads) {
  const GridLayout layout = gridOfCells(torus().domain(), {20, 21, 22});
  const RegularGrid grid = sampleGrid(torus(), layout, true, 1);
  const RegularGrid other = sampleGrid(torus(), layout, true, 3);
  EXPECT_EQ(grid.values, other.values);
  EXPECT_EQ(grid.gradients, other.gradients);
  const std::size_t number = 3 + 21 * (4 + 22 * 5);
  const ValueAndGradient expected = torus().valueAndGradient(layout.position(3, 4, 5));
  EXPECT_EQ(grid.values[number], expected.value);
  EXPECT_EQ(grid.gradients[number], expected.gradient);
  EXPECT_TRUE(sampleGrid(torus(), layout, false).gradients.empty());
}

TEST(Grids, imageDataHoldValuesAndGradients) {
  const RegularGrid grid = sampleGrid(torus(), gridOfCells(torus().domain(), {60, 61, 62}), true);
  const std::string file = fileOf([&](OutputFile& out) { writeVti(grid, NumberType::float64, out); });
  EXPECT_EQ(textBetween(file, "WholeExtent=\"", "\""), "0 60 0 61 0 62");
  EXPECT_EQ(std::stod(textBetween(file, "Origin=\"", " ")), grid.layout.origin.x());
  EXPECT_EQ(std::stod(textBetween(file, "Spacing=\"", " ")), grid.layout.spacing.x());
  EXPECT_EQ(arrayOf<double>(file, "distance"), grid.values) << "in more than one block";
  const std::vector<double> gradients = arrayOf<double>(file, "gradient");
  ASSERT_EQ(gradients.size(), 3 * grid.values.size());
  EXPECT_EQ(Vector3(gradients[300], gradients[301], gradients[302]), grid.gradients[100]);
  const std::string rounded = fileOf([&](OutputFile& out) { writeVti(grid, NumberType::float32, out); });
  EXPECT_EQ(arrayOf<float>(rounded, "distance")[7], float(grid.values[7]));
  EXPECT_LT(rounded.size(), file.size());
}

TEST(Grids, arraysForNumPyHaveXFastest) {
  const RegularGrid grid = sampleGrid(torus(), gridOfCells(torus().domain(), {2, 3, 4}), true);
  const std::string file = fileOf([&](OutputFile& out) { writeNpy(grid, NumberType::float64, out); });
  EXPECT_THAT(file, testing::HasSubstr("'shape': (5, 4, 3, 4)"));
  ASSERT_EQ(file.size(), 128 + 8 * 4 * grid.values.size());
  std::array<double, 4> second;
  std::memcpy(second.data(), file.data() + 128 + 8 * 4, sizeof(second));
  EXPECT_EQ(second[0], grid.values[1]);
  EXPECT_EQ(Vector3(second[1], second[2], second[3]), grid.gradients[1]);
}

TEST(Grids, leavesHaveTheValuesOfTheirOwnPolynomials) {
  const Field& field = torus();
  const std::string file = fileOf([&](OutputFile& out) { writeVtu(field, {.type = NumberType::float64}, out); });
  const auto degrees = arrayOf<std::uint8_t>(file, "degree"), depths = arrayOf<std::uint8_t>(file, "depth");
  const auto errors = arrayOf<double>(file, "error"), jumps = arrayOf<double>(file, "jump");
  const auto points = arrayOf<double>(file, "Points"), values = arrayOf<double>(file, "distance");
  const std::vector<double> worst = worstJumpOfCells(field, findJumps(field), JumpKind::value);
  std::size_t cell = 0;
  field.forEachCell([&](const Cell& leaf) {
    EXPECT_EQ(degrees[cell], leaf.degree);
    EXPECT_EQ(depths[cell], leaf.depth);
    EXPECT_DOUBLE_EQ(errors[cell] * errors[cell] * leaf.box.volume(), leaf.error);
    EXPECT_EQ(jumps[cell], worst[leaf.id]);
    for (std::size_t corner = 8 * cell; corner < 8 * cell + 8; ++corner) {
      const Vector3 x(points[3 * corner], points[3 * corner + 1], points[3 * corner + 2]);
      EXPECT_TRUE(leaf.box.exteriorDistance(x) < 1e-12);
      const Vector3 within = x + 1e-9 * (leaf.box.center() - x);
      EXPECT_NEAR(values[corner], field.value(within), 1e-7);
    }
    ++cell;
  });
  EXPECT_EQ(degrees.size(), cell);
  EXPECT_EQ(arrayOf<std::uint8_t>(file, "types"), std::vector<std::uint8_t>(cell, 11));
  EXPECT_EQ(arrayOf<std::int64_t>(file, "offsets").back(), std::int64_t(8 * cell));
}

TEST(Grids, blendedLeavesAgreeAtTheirCorners) {
  const Field field = blended(torus());
  const std::string file = fileOf([&](OutputFile& out) { writeVtu(field, {.type = NumberType::float64}, out); });
  const auto points = arrayOf<double>(file, "Points"), values = arrayOf<double>(file, "distance");
  for (std::size_t n = 0; n < values.size(); ++n)
    EXPECT_NEAR(values[n], field.value(Vector3(points[3 * n], points[3 * n + 1], points[3 * n + 2])), 1e-12);
}

TEST(Grids, lagrangeCellsHoldThePolynomialOfALeaf) {
  const Field field = oneLeafField(3, 4);
  const std::string file =
      fileOf([&](OutputFile& out) { writeVtu(field, {.order = 6, .type = NumberType::float64}, out); });
  EXPECT_EQ(arrayOf<std::uint8_t>(file, "types"), std::vector<std::uint8_t>{72});
  const auto points = arrayOf<double>(file, "Points"), values = arrayOf<double>(file, "distance");
  ASSERT_EQ(values.size(), 125u) << "of order 4, the leaf's degree";
  for (std::size_t n = 0; n < values.size(); ++n)
    EXPECT_NEAR(values[n], field.value(Vector3(points[3 * n], points[3 * n + 1], points[3 * n + 2])), 1e-12);
  // The first points are the corners, against the clock below and then above; the last one lies within the cell.
  const Box& box = field.domain();
  EXPECT_EQ(Vector3(points[6], points[7], points[8]), Vector3(box.max().x(), box.max().y(), box.min().z()));
  EXPECT_TRUE(Vector3(points[372], points[373], points[374]).isApprox(box.center() + box.sizes() / 4, 1e-15));
}

TEST(Grids, filesOfLeavesDoNotDependOnThreads) {
  const auto fileBy = [&](int threads) {
    return fileOf([&](OutputFile& out) { writeVtu(torus(), {.order = 3, .threads = threads}, out); });
  };
  EXPECT_EQ(fileBy(1), fileBy(4));
  EXPECT_THROW(fileOf([&](OutputFile& out) { writeVtu(torus(), {.order = 11}, out); }), Error);
}

}  // namespace grids_test
}  // namespace hpsdf
