#include "hpsdf/detail/cubic_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numeric>
#include <set>
#include <string>

#include "hpsdf/error.h"
#include "support/cubic_grid_file.h"
#include "support/one_leaf_field.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace cubic_grid_test {

/// Reads numbers one after the other from the bytes of a file.
class Reader {
 public:
  explicit Reader(const std::string& bytes) : rest_(bytes) {}

  template <typename T>
  T number() {
    T value{};
    if (rest_.size() < sizeof(T)) throw std::runtime_error("the file is too short");
    std::memcpy(&value, rest_.data(), sizeof(T));
    rest_.remove_prefix(sizeof(T));
    return value;
  }
  std::uint64_t size() { return number<std::uint64_t>(); }
  template <typename T>
  std::vector<T> list() {
    std::vector<T> values(size());
    for (T& value : values) value = number<T>();
    return values;
  }
  Vector3 vector() {
    const double x = number<double>(), y = number<double>(), z = number<double>();
    return {x, y, z};
  }
  bool atEnd() const { return rest_.empty(); }

 private:
  std::string_view rest_;
};

/// Positions of a cell's nodes in thirds of its edges, in the order of the file format.
constexpr int kNodePositions[32][3] = {
    {0, 0, 0}, {3, 0, 0}, {0, 3, 0}, {3, 3, 0}, {0, 0, 3}, {3, 0, 3}, {0, 3, 3}, {3, 3, 3},   // corners
    {1, 0, 0}, {2, 0, 0}, {1, 0, 3}, {2, 0, 3}, {1, 3, 0}, {2, 3, 0}, {1, 3, 3}, {2, 3, 3},   // on edges along x
    {0, 1, 0}, {0, 2, 0}, {3, 1, 0}, {3, 2, 0}, {0, 1, 3}, {0, 2, 3}, {3, 1, 3}, {3, 2, 3},   // on edges along y
    {0, 0, 1}, {0, 0, 2}, {0, 3, 1}, {0, 3, 2}, {3, 0, 1}, {3, 0, 2}, {3, 3, 1}, {3, 3, 2}};  // on edges along z

TEST(CubicGrid, writesTheNodesOfEachCellInTheOrderOfTheFormat) {
  const Field field = oneLeafField(1, 2);
  const CubicGrid grid = sampleCubicGrid(field, {2, 3, 4});
  const std::string bytes = fileOf(grid);
  EXPECT_EQ(double(bytes.size()), cubicGridBytes({2, 3, 4}));
  Reader reader(bytes);
  const Vector3 lower = reader.vector(), upper = reader.vector();
  EXPECT_EQ(lower, field.domain().min());
  EXPECT_EQ(upper, field.domain().max());
  for (const std::uint32_t cells : {2u, 3u, 4u}) EXPECT_EQ(reader.number<std::uint32_t>(), cells);
  const Vector3 size = reader.vector();
  EXPECT_TRUE(size.isApprox((upper - lower).cwiseQuotient(Vector3(2, 3, 4)), 1e-15));
  EXPECT_TRUE(reader.vector().isApprox(size.cwiseInverse(), 1e-15));
  EXPECT_EQ(reader.size(), 24u) << "cells";
  EXPECT_EQ(reader.size(), 1u) << "fields";
  ASSERT_EQ(reader.size(), 1u) << "lists of nodes";
  const auto nodes = reader.list<double>();
  ASSERT_EQ(nodes.size(), 60u + 2 * (2 * 4 * 5 + 3 * 3 * 5 + 3 * 4 * 4));
  ASSERT_EQ(reader.size(), 1u) << "lists of cells";
  ASSERT_EQ(reader.size(), 24u);
  std::set<std::uint32_t> used;
  for (int z = 0; z < 4; ++z)
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 2; ++x)
        for (const auto& position : kNodePositions) {
          const auto node = reader.number<std::uint32_t>();
          ASSERT_LT(node, nodes.size());
          used.insert(node);
          const Vector3 at(x + position[0] / 3.0, y + position[1] / 3.0, z + position[2] / 3.0);
          EXPECT_NEAR(nodes[node], field.value(lower + size.cwiseProduct(at)), 1e-13);
        }
  EXPECT_EQ(used.size(), nodes.size()) << "neighbours share all their nodes, and none is left over";
  ASSERT_EQ(reader.size(), 1u) << "lists of the cells' positions";
  std::vector<std::uint32_t> positions(24);
  std::iota(positions.begin(), positions.end(), 0u);
  EXPECT_EQ(reader.list<std::uint32_t>(), positions);
  EXPECT_TRUE(reader.atEnd());
}

TEST(CubicGrid, reproducesCubicPolynomials) {
  for (const int degree : {3, 4}) {
    const Field field = oneLeafField(2, degree);
    const CubicGridError error = measureCubicGrid(sampleCubicGrid(field, {2, 1, 3}), field, 1000);
    EXPECT_EQ(error.everywhere.points, 1000u);
    if (degree == 3) {
      EXPECT_LT(error.everywhere.max, 1e-13);
    } else {
      EXPECT_GT(error.everywhere.rms, 1e-3);
    }
  }
}

TEST(CubicGrid, convergesWithFourthOrder) {
  const Field field = oneLeafField(3, 6);
  const auto rms = [&](std::uint32_t n) {
    return measureCubicGrid(sampleCubicGrid(field, {n, n, n}), field, 20000).everywhere.rms;
  };
  EXPECT_NEAR(rms(8) / rms(16), 16, 1);
  EXPECT_NEAR(rms(16) / rms(32), 16, 1);
}

TEST(CubicGrid, convergesWithFirstOrderAtACrease) {
  FieldData data;  // the function |x|; for odd n its crease lies inside a cell
  data.domain = Box(Vector3(-1, 0, 0), Vector3(1, 1, 1));
  data.grid = {2, 1, 1};
  data.nodes = {node::leaf(1, 0), node::leaf(1, 4)};
  data.coefficients = std::vector<double>{0.5, 0, 0, -0.5, 0.5, 0, 0, 0.5};
  const Field field(std::move(data));
  const auto max = [&](std::uint32_t n) {
    return measureCubicGrid(sampleCubicGrid(field, {n, 1, 1}), field, 20000).everywhere.max;
  };
  EXPECT_NEAR(max(11) / max(21), 21.0 / 11, 0.02);
  EXPECT_NEAR(max(21) / max(41), 41.0 / 21, 0.02);
}

TEST(CubicGrid, measuresAKnownDifference) {
  const Field field = oneLeafField(4, 1);
  CubicGrid grid = sampleCubicGrid(field, {3, 3, 3});
  for (double& node : grid.nodes) node += 0.5;
  const CubicGridError error = measureCubicGrid(grid, field, 5000);
  EXPECT_NEAR(error.everywhere.rms, 0.5, 1e-13);
  EXPECT_NEAR(error.everywhere.max, 0.5, 1e-13);
  EXPECT_DOUBLE_EQ(error.near, grid.cellSize().norm());
  EXPECT_GT(error.nearSurface.points, 0u);
  EXPECT_LT(error.nearSurface.points, 5000u);

  const Field far([&] {
    FieldData data = field.data();
    std::get<FieldArray<double>>(data.coefficients).values()[0] += 100;
    return data;
  }());
  const GridDifference none = measureCubicGrid(sampleCubicGrid(far, {3, 3, 3}), far, 5000).nearSurface;
  EXPECT_EQ(none.points, 0u);
  EXPECT_EQ(none.rms, 0);
}

TEST(CubicGrid, choosesNearlyCubicCells) {
  const Box flat(Vector3(0, 0, 0), Vector3(2, 1, 0.01));
  EXPECT_EQ(cubicGridResolution(flat, 9), (GridResolution{9, 5, 1}));
  const GridResolution finest = finestCubicGrid(flat, 1'000'000);
  EXPECT_LE(cubicGridBytes(finest), 1e6);
  EXPECT_GT(cubicGridBytes(cubicGridResolution(flat, finest[0] + 1)), 1e6);
  EXPECT_EQ(finestCubicGrid(flat, 560), (GridResolution{1, 1, 1}));
  EXPECT_THROW(finestCubicGrid(flat, 559), Error);
}

TEST(CubicGrid, refusesFilesTooLargeForBulletBeforeAllocating) {
  const Field field = oneLeafField(5, 1);
  for (const GridResolution& resolution :
       {GridResolution{225, 225, 225}, GridResolution{4'000'000'000, 4'000'000'000, 4'000'000'000},
        GridResolution{0, 5, 5}})
    EXPECT_THROW(sampleCubicGrid(field, resolution), Error);
  EXPECT_LE(cubicGridBytes({224, 224, 224}), double(kMaxCubicGridBytes));
}

TEST(CubicGrid, refusesToWriteAGridThatLacksNodes) {
  CubicGrid grid = sampleCubicGrid(oneLeafField(5, 1), {2, 2, 2});
  grid.nodes.pop_back();
  const support::TemporaryDirectory folder;
  OutputFile out(folder / "grid.cdf");
  EXPECT_THROW(writeCubicGrid(grid, out), Error);
}

TEST(CubicGrid, doesNotDependOnTheNumberOfThreads) {
  const Field field = oneLeafField(6, 5);
  const CubicGrid grid = sampleCubicGrid(field, {20, 20, 20}, 1);
  EXPECT_EQ(sampleCubicGrid(field, {20, 20, 20}, 4).nodes, grid.nodes);
  const CubicGridError one = measureCubicGrid(grid, field, 10000, 7, 1),
                       four = measureCubicGrid(grid, field, 10000, 7, 4);
  EXPECT_EQ(one.everywhere.rms, four.everywhere.rms);
  EXPECT_EQ(one.nearSurface.rms, four.nearSurface.rms);
  EXPECT_NE(one.everywhere.rms, measureCubicGrid(grid, field, 10000, 8).everywhere.rms) << "other points";
}

TEST(CubicGrid, canBeCancelled) {
  const Field field = oneLeafField(6, 3);
  const CubicGrid grid = sampleCubicGrid(field, {3, 3, 3});
  double fraction = 0;
  const Progress watched{.report = [&](std::string_view, double done) { fraction = done; }, .cancelled = {}};
  sampleCubicGrid(field, {3, 3, 3}, 0, watched);
  EXPECT_EQ(fraction, 1);
  const Progress cancelled{.report = {}, .cancelled = [] { return true; }};
  EXPECT_THROW(sampleCubicGrid(field, {3, 3, 3}, 0, cancelled), Cancelled);
  EXPECT_THROW(measureCubicGrid(grid, field, 10, 1, 0, cancelled), Cancelled);
  const support::TemporaryDirectory folder;
  OutputFile out(folder / "grid.cdf");
  EXPECT_THROW(writeCubicGrid(grid, out, cancelled), Cancelled);
}

}  // namespace cubic_grid_test
}  // namespace hpsdf
