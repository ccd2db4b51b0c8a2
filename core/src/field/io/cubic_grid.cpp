// Samples fields at the nodes of a regular grid whose cells have cubic shape functions, and writes the samples to
// files (docs/export.md describes their layout).
#include "hpsdf/detail/cubic_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include "hpsdf/detail/random_points.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "util/chunks.h"
#include "util/refuse.h"

namespace hpsdf {
namespace {

static_assert(std::endian::native == std::endian::little,
              "files are little-endian and arrays are written without conversion");
static_assert(sizeof(double) == 8 && std::numeric_limits<double>::is_iec559);

constexpr std::size_t kPointsPerQuery = 4096;  // number of points for which the field is queried at once
constexpr int kNodesOfCell = 32;
constexpr std::size_t kSizesInFile = 8;  // number of cells, number of fields, and two sizes for each of three lists

using GridIndex = std::array<std::uint64_t, 3>;

/// A node of the cubic grid, at a corner or on an edge of a cell.
struct Node {
  GridIndex index;  ///< the corner, or the lower end of the edge, in cells from the domain's lower corner
  int axis = -1;    ///< axis of the edge; −1 for a corner
  int third = 0;    ///< 0 or 1: the lower or the upper node of the edge
};

/// Gives each node of a grid its index in `CubicGrid::nodes`.
class Numbering {
 public:
  explicit Numbering(const GridResolution& resolution) : cells_{resolution[0], resolution[1], resolution[2]} {
    first_[0] = (cells_[0] + 1) * (cells_[1] + 1) * (cells_[2] + 1);
    for (int axis = 0; axis < 3; ++axis)
      first_[axis + 1] = first_[axis] + 2 * cells_[axis] * (cells_[after(axis, 1)] + 1) * (cells_[after(axis, 2)] + 1);
  }

  std::uint64_t count() const { return first_[3]; }

  std::uint64_t number(const Node& node) const {
    const GridIndex& at = node.index;
    if (node.axis < 0) return at[0] + (cells_[0] + 1) * (at[1] + (cells_[1] + 1) * at[2]);
    const int a = node.axis, b = after(a, 1), c = after(a, 2);
    return first_[a] + 2 * (at[a] + cells_[a] * (at[b] + (cells_[b] + 1) * at[c])) + std::uint64_t(node.third);
  }

  Node node(std::uint64_t number) const {
    const auto takeDigit = [&number](std::uint64_t base) {
      const std::uint64_t digit = number % base;
      number /= base;
      return digit;
    };
    Node node{};
    if (number < first_[0]) {
      for (int axis = 0; axis < 3; ++axis) node.index[axis] = takeDigit(cells_[axis] + 1);
      return node;
    }
    node.axis = number < first_[1] ? 0 : number < first_[2] ? 1 : 2;
    number -= first_[node.axis];
    node.third = int(takeDigit(2));
    node.index[node.axis] = takeDigit(cells_[node.axis]);
    node.index[after(node.axis, 1)] = takeDigit(cells_[after(node.axis, 1)] + 1);
    node.index[after(node.axis, 2)] = number;
    return node;
  }

  static int after(int axis, int steps) { return (axis + steps) % 3; }

 private:
  GridIndex cells_;
  std::array<std::uint64_t, 4> first_{};  ///< number of the first node on edges along x, y and z; last, the node count
};

/// Returns the n-th node of the cell with the lower corner `corner`. Nodes 0 to 7 are the cell's corners, n = x +
/// 2y + 4z. They are followed by the nodes on edges along x, then along y, then along z. Two edges along an axis
/// a that differ only in their position along axis a+2 (cyclic) come directly one after the other.
Node nodeOfCell(GridIndex corner, int n) {
  if (n < 8) {
    for (int axis = 0; axis < 3; ++axis) corner[axis] += n >> axis & 1;
    return {corner};
  }
  const int axis = (n - 8) / 8, edge = n / 2 % 4;
  corner[Numbering::after(axis, 2)] += edge & 1;
  corner[Numbering::after(axis, 1)] += edge >> 1;
  return {corner, axis, n % 2};
}

/// Returns the position of a node, bit for bit as the programs that load the files compute it.
Vector3 positionOf(const Node& node, const Vector3& lower, const Vector3& cellSize) {
  Vector3 x = lower;
  for (int axis = 0; axis < 3; ++axis) x[axis] += cellSize[axis] * static_cast<double>(node.index[axis]);
  if (node.axis >= 0) x[node.axis] += (1 + node.third) / 3.0 * cellSize[node.axis];
  return x;
}

/// Evaluates the n-th shape function of a cell at local coordinates in [−1, 1]³. It is the cubic serendipity
/// polynomial that is 1 at the cell's n-th node and 0 at the other nodes.
double shapeFunction(int n, const Vector3& local) {
  const Node node = nodeOfCell({0, 0, 0}, n);
  double product = 1;
  for (int axis = 0; axis < 3; ++axis)
    if (axis != node.axis) product *= node.index[axis] == 0 ? 1 - local[axis] : 1 + local[axis];
  if (node.axis < 0) return product * (9 * local.squaredNorm() - 19) / 64;
  const double t = local[node.axis];
  return product * (1 - t * t) * (node.third == 0 ? 1 - 3 * t : 1 + 3 * t) * 9 / 64;
}

void checkResolution(const GridResolution& resolution) {
  if (std::ranges::find(resolution, 0u) != resolution.end())
    throw Error("a grid without cells; give at least one cell along each axis");
  const double bytes = cubicGridBytes(resolution);
  if (bytes <= double(kMaxCubicGridBytes)) return;
  detail::refuse("a grid of ", resolution[0], " x ", resolution[1], " x ", resolution[2], " cells takes ",
                 std::uint64_t(std::min(std::ceil(bytes / 1e6), 1e18)),
                 " MB as a file, of which Bullet's loader reads 2147 at most; give fewer cells");
}

template <typename T>
void writeAll(OutputFile& out, std::span<const T> values) {
  out.write(std::as_bytes(values));
}
void writeSize(OutputFile& out, std::uint64_t size) { writeAll(out, std::span<const std::uint64_t>(&size, 1)); }
void writeVector(OutputFile& out, const Vector3& v) { writeAll(out, std::span<const double>(v.data(), 3)); }

/// Computes the node numbers of the cells in a row along x.
void numberRow(const Numbering& numbering, std::uint32_t cells, std::uint64_t y, std::uint64_t z,
               std::vector<std::uint32_t>& row) {
  row.clear();
  for (std::uint64_t x = 0; x < cells; ++x)
    for (int n = 0; n < kNodesOfCell; ++n)
      row.push_back(static_cast<std::uint32_t>(numbering.number(nodeOfCell({x, y, z}, n))));
}

}  // namespace

double CubicGrid::value(const Vector3& x) const {
  const Vector3 size = cellSize();
  GridIndex cell;
  for (int axis = 0; axis < 3; ++axis) {
    const double at = (x[axis] - domain.min()[axis]) / size[axis];
    cell[axis] = static_cast<std::uint64_t>(std::clamp(at, 0.0, double(resolution[axis] - 1)));
  }
  const Vector3 lower = positionOf({cell}, domain.min(), size);
  const Vector3 local = 2 * (x - lower).cwiseQuotient(size) - Vector3::Ones();
  const Numbering numbering(resolution);
  double sum = 0;
  for (int n = 0; n < kNodesOfCell; ++n) sum += nodes[numbering.number(nodeOfCell(cell, n))] * shapeFunction(n, local);
  return sum;
}

double cubicGridBytes(const GridResolution& resolution) {
  const double x = resolution[0], y = resolution[1], z = resolution[2];
  const double corners = (x + 1) * (y + 1) * (z + 1);
  const double edges = x * (y + 1) * (z + 1) + (x + 1) * y * (z + 1) + (x + 1) * (y + 1) * z;
  const double header = 6 * sizeof(double) + 3 * sizeof(std::uint32_t) + 6 * sizeof(double);
  return header + kSizesInFile * sizeof(std::uint64_t) + sizeof(double) * (corners + 2 * edges) +
         sizeof(std::uint32_t) * (kNodesOfCell + 1) * x * y * z;
}

GridResolution cubicGridResolution(const Box& domain, std::uint32_t alongLongest) {
  GridResolution resolution;
  for (int axis = 0; axis < 3; ++axis) {
    const double share = domain.sizes()[axis] / domain.sizes().maxCoeff();
    resolution[axis] = static_cast<std::uint32_t>(std::max(1.0, std::round(share * alongLongest)));
  }
  return resolution;
}

GridResolution finestCubicGrid(const Box& domain, std::uint64_t bytes) {
  const auto fits = [&](std::uint32_t n) { return cubicGridBytes(cubicGridResolution(domain, n)) <= double(bytes); };
  if (!fits(1))
    detail::refuse("not even a single cell fits into ", bytes, " bytes; give ",
                   static_cast<std::uint64_t>(cubicGridBytes({1, 1, 1})), " at least");
  std::uint32_t fitting = 1, tooFine = std::numeric_limits<std::uint32_t>::max();
  while (tooFine - fitting > 1) {
    const std::uint32_t middle = fitting + (tooFine - fitting) / 2;
    (fits(middle) ? fitting : tooFine) = middle;
  }
  return cubicGridResolution(domain, fitting);
}

CubicGrid sampleCubicGrid(const Field& field, const GridResolution& resolution, int threads, const Progress& progress) {
  checkResolution(resolution);
  CubicGrid grid{.domain = field.domain(), .resolution = resolution, .nodes = {}};
  const Numbering numbering(resolution);
  const Vector3 lower = grid.domain.min(), cellSize = grid.cellSize();
  grid.nodes.resize(numbering.count());
  withThreads(threads, [&] {
    const auto sample = [&](std::size_t, std::size_t first, std::size_t count) {
      std::vector<Vector3> points(count);
      for (std::size_t n = 0; n < count; ++n) points[n] = positionOf(numbering.node(first + n), lower, cellSize);
      field.values(points, std::span(grid.nodes).subspan(first, count));
    };
    detail::forEachChunk(grid.nodes.size(), kPointsPerQuery, progress, "sampling", sample);
  });
  return grid;
}

CubicGridError measureCubicGrid(const CubicGrid& grid, const Field& field, std::size_t points, std::uint64_t seed,
                                int threads, const Progress& progress) {
  struct Differences {
    detail::Sums everywhere, nearSurface;

    void add(const Differences& other) {
      everywhere.add(other.everywhere);
      nearSurface.add(other.nearSurface);
    }
  };
  const double near = grid.cellSize().norm();
  const auto measure = [&](Differences& differences, std::size_t first, std::size_t count) {
    std::vector<Vector3> at(count);
    std::vector<double> values(count);
    for (std::size_t n = 0; n < count; ++n) at[n] = detail::Random(seed, first + n).inBox(grid.domain);
    field.values(at, values);
    for (std::size_t n = 0; n < count; ++n) {
      const double difference = std::abs(grid.value(at[n]) - values[n]);
      differences.everywhere.add(difference);
      if (std::abs(values[n]) <= near) differences.nearSurface.add(difference);
    }
  };
  const Differences all = withThreads(threads, [&] {
    return detail::sumOfChunks<Differences>(points, kPointsPerQuery, progress, "measuring", measure);
  });
  const auto figures = [](const detail::Sums& sums) { return GridDifference{sums.count, sums.rms(), sums.max}; };
  return {figures(all.everywhere), figures(all.nearSurface), near};
}

void writeCubicGrid(const CubicGrid& grid, OutputFile& out, const Progress& progress) {
  checkResolution(grid.resolution);
  const Numbering numbering(grid.resolution);
  if (grid.nodes.size() != numbering.count())
    detail::refuse("a grid with ", grid.nodes.size(), " nodes instead of ", numbering.count(), "; sample it anew");
  const auto& [nx, ny, nz] = grid.resolution;
  const std::uint64_t cells = std::uint64_t{nx} * ny * nz;
  writeVector(out, grid.domain.min());
  writeVector(out, grid.domain.max());
  writeAll(out, std::span<const std::uint32_t>(grid.resolution));
  writeVector(out, grid.cellSize());
  writeVector(out, grid.cellSize().cwiseInverse());
  writeSize(out, cells);
  writeSize(out, 1);  // number of fields

  // Write the list of the values at the nodes. The file has one such list for each field, and it has one field.
  writeSize(out, 1);
  writeSize(out, grid.nodes.size());
  writeAll(out, std::span<const double>(grid.nodes));

  // Write the list of each cell's nodes. The file has one such list for each field, and it has one field.
  writeSize(out, 1);
  writeSize(out, cells);
  detail::Parts parts(progress, "writing", std::size_t{ny} * nz);
  std::vector<std::uint32_t> row;
  for (std::uint32_t z = 0; z < nz; ++z)
    for (std::uint32_t y = 0; y < ny; ++y) {
      parts.begin();
      numberRow(numbering, nx, y, z, row);
      writeAll(out, std::span<const std::uint32_t>(row));
      parts.end();
    }

  // Write each cell's position in the list of cells. The positions are 0, 1, 2, … because no cell is omitted.
  writeSize(out, 1);
  writeSize(out, cells);
  std::vector<std::uint32_t> positions(cells);
  std::iota(positions.begin(), positions.end(), 0u);
  writeAll(out, std::span<const std::uint32_t>(positions));
  out.flush();
}

}  // namespace hpsdf
