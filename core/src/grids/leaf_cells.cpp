// Writes the leaves of fields as unstructured grids of VTK.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "field/query/blend.h"
#include "field/query/leaves.h"
#include "grids/lagrange_points.h"
#include "grids/vtk_file.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/jumps.h"
#include "hpsdf/output/grids.h"
#include "util/chunks.h"

namespace hpsdf {
namespace {

constexpr std::uint8_t kVtkVoxel = 11, kVtkLagrangeHexahedron = 72;
constexpr std::size_t kLeavesOfChunk = 256;

/// The leaves of a field as cells of VTK, and where their points begin.
class LeafCells {
 public:
  LeafCells(const Field& field, int order) : field_(field), leaves_(query::allLeaves(field.data())) {
    pointsOfOrder_.resize(std::size_t(order) + 1);
    pointsOfOrder_[1] = grids::voxelPoints();
    for (int n = 2; n <= order; ++n) pointsOfOrder_[n] = grids::lagrangePoints(n);
    firstPoints_ = {0};
    for (const query::OctreeNode& leaf : leaves_) {
      const int degree = node::degree(field.data().nodes[leaf.node]);
      orders_.push_back(static_cast<std::uint8_t>(std::clamp(degree, 1, order)));
      firstPoints_.push_back(firstPoints_.back() + std::int64_t(pointsOf(orders_.size() - 1).size()));
    }
  }

  std::size_t count() const { return leaves_.size(); }
  std::size_t pointCount() const { return std::size_t(firstPoints_.back()); }
  const query::OctreeNode& leaf(std::size_t cell) const { return leaves_[cell]; }

  /// Returns the number of points of the first cell, of the first two, and so on.
  std::span<const std::int64_t> pointEnds() const { return std::span(firstPoints_).subspan(1); }

  std::vector<std::uint8_t> types() const {
    std::vector<std::uint8_t> types;
    for (const std::uint8_t order : orders_) types.push_back(order == 1 ? kVtkVoxel : kVtkLagrangeHexahedron);
    return types;
  }

  /// Computes positions (three numbers each) and values of the points of a cell.
  void sample(std::size_t cell, std::vector<double>& positions, std::vector<double>& values) const {
    std::size_t at = std::size_t(firstPoints_[cell]);
    for (const grids::PointIndex& index : pointsOf(cell)) {
      const std::array<double, 3> grid = gridCoordinates(cell, index);
      const Vector3 x = query::worldPoint(field_.lookupGrid().frame, grid);
      std::copy_n(x.data(), 3, &positions[3 * at]);
      values[at++] = valueAt(cell, grid);
    }
  }

 private:
  const std::vector<grids::PointIndex>& pointsOf(std::size_t cell) const { return pointsOfOrder_[orders_[cell]]; }

  std::array<double, 3> gridCoordinates(std::size_t cell, const grids::PointIndex& index) const {
    const query::OctreeNode& leaf = leaves_[cell];
    std::array<double, 3> grid;
    for (int axis = 0; axis < 3; ++axis)
      grid[axis] = std::ldexp(double(leaf.cellIndex[axis]) + double(index[axis]) / orders_[cell], -leaf.depth);
    return grid;
  }

  /// Returns the value of the cell's own polynomial, or of the field if this is blended and thus continuous.
  double valueAt(std::size_t cell, const std::array<double, 3>& grid) const {
    const FieldData& data = field_.data();
    const GridFrame& frame = field_.lookupGrid().frame;
    if (data.blend > 0)
      return query::evaluateInLeaf<double>(data, field_.lookupGrid(), grid,
                                           query::findLeaf(data, field_.lookupGrid(), query::gridPoint(frame, grid)));
    const query::OctreeNode& leaf = leaves_[cell];
    return query::evaluateLeaf<double>(data, frame, grid,
                                       query::leafPoint(data.nodes[leaf.node], leaf.depth, 0, leaf.cellIndex, grid));
  }

  const Field& field_;
  std::vector<query::OctreeNode> leaves_;
  std::vector<std::uint8_t> orders_;
  std::vector<std::int64_t> firstPoints_;
  std::vector<std::vector<grids::PointIndex>> pointsOfOrder_;
};

/// Data of the leaves, one number for each.
struct LeafCellData {
  std::vector<std::uint8_t> degree, depth;
  std::vector<double> error, jump;
};

LeafCellData cellDataOf(const Field& field, const Jumps& jumps) {
  const std::vector<double> worst = worstJumpOfCells(field, jumps, JumpKind::value);
  LeafCellData data;
  field.forEachCell([&](const Cell& cell) {
    data.degree.push_back(static_cast<std::uint8_t>(cell.degree));
    data.depth.push_back(static_cast<std::uint8_t>(cell.depth));
    data.error.push_back(std::sqrt(cell.error / cell.box.volume()));
    data.jump.push_back(worst[cell.id]);
  });
  return data;
}

void addPoints(const LeafCells& cells, NumberType type, int threads, const Progress& progress, grids::VtkFile& file) {
  std::vector<double> positions(3 * cells.pointCount()), values(cells.pointCount());
  withThreads(threads, [&] {
    const auto sample = [&](std::size_t, std::size_t first, std::size_t count) {
      for (std::size_t cell = first; cell < first + count; ++cell) cells.sample(cell, positions, values);
    };
    detail::forEachChunk(cells.count(), kLeavesOfChunk, progress, "sampling", sample);
  });
  file.open("PointData", {{"Scalars", "distance"}});
  file.array("distance", type, values);
  file.close();
  file.open("Points");
  file.array("Points", type, positions, 3);
  file.close();
}

void addCells(const LeafCells& cells, grids::VtkFile& file) {
  std::vector<std::int64_t> connectivity(cells.pointCount());
  std::iota(connectivity.begin(), connectivity.end(), 0);
  file.open("Cells");
  file.array("connectivity", std::span<const std::int64_t>(connectivity));
  file.array("offsets", cells.pointEnds());
  file.array("types", std::span<const std::uint8_t>(cells.types()));
  file.close();
}

void addCellData(const Field& field, const LeafCellOptions& options, const Progress& progress, grids::VtkFile& file) {
  const LeafCellData data = cellDataOf(field, findJumps(field, options.threads, progress));
  file.open("CellData", {{"Scalars", "degree"}});
  file.array("degree", std::span<const std::uint8_t>(data.degree));
  file.array("depth", std::span<const std::uint8_t>(data.depth));
  file.array("error", options.type, data.error);
  file.array("jump", options.type, data.jump);
  file.close();
}

void checkLeafCellMemory(const LeafCells& cells, int order) {
  constexpr double kBytesOfPoint = 2 * 4 * sizeof(double) + 2 * sizeof(std::int64_t);  // numbers, and compressed ones
  requireMemory(std::to_string(cells.pointCount()) + " points of cells of order " + std::to_string(order),
                kBytesOfPoint * double(cells.pointCount()), "give a lower order");
}

}  // namespace

void writeVtu(const Field& field, const LeafCellOptions& options, OutputFile& out, const Progress& progress) {
  if (options.order < 1 || options.order > kMaxLagrangeOrder)
    throw Error(ErrorKind::option, "order", "must be between 1 and " + std::to_string(kMaxLagrangeOrder));
  const LeafCells cells(field, options.order);
  checkLeafCellMemory(cells, options.order);
  grids::VtkFile file("UnstructuredGrid", options.order == 1 ? grids::kVtkVersion : grids::kVtkVersionOfLagrangeCells,
                      progress);
  file.open("UnstructuredGrid");
  file.open("Piece",
            {{"NumberOfPoints", std::to_string(cells.pointCount())}, {"NumberOfCells", std::to_string(cells.count())}});
  addPoints(cells, options.type, options.threads, progress, file);
  addCells(cells, file);
  addCellData(field, options, progress, file);
  file.write(out);
}

}  // namespace hpsdf
