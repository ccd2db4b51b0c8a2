// The layout of files is described in docs/export.md.
#include "hpsdf/detail/cubic_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "util/chunks.h"
#include "util/random_points.h"
#include "util/sums.h"

namespace hpsdf {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little-endian and arrays are written as they are");
static_assert(sizeof(double) == 8 && std::numeric_limits<double>::is_iec559);

constexpr std::size_t kChunk = 4096;  // points that are looked up together
constexpr int kNodesOfCell = 32;
constexpr std::size_t kSizesInFile = 8;  // numbers of cells and fields, and two lengths of each of three lists

using Place = std::array<std::uint64_t, 3>;

/// A node: at a cell's corner, or on an edge.
struct Node {
  Place place;    ///< of the corner, or of the edge's lower end, in cells from the domain's lower corner
  int axis = -1;  ///< along which the edge runs
  int third = 0;  ///< 0 or 1: the node on the edge
};

/// Numbers all nodes of a grid, as the format has it (`CubicGrid::nodes`).
class Numbering {
 public:
  explicit Numbering(const GridResolution& resolution) : cells_{resolution[0], resolution[1], resolution[2]} {
    first_[0] = (cells_[0] + 1) * (cells_[1] + 1) * (cells_[2] + 1);
    for (int axis = 0; axis < 3; ++axis)
      first_[axis + 1] = first_[axis] + 2 * cells_[axis] * (cells_[after(axis, 1)] + 1) * (cells_[after(axis, 2)] + 1);
  }

  std::uint64_t count() const { return first_[3]; }

  std::uint64_t numberOf(const Node& node) const {
    const Place& at = node.place;
    if (node.axis < 0) return at[0] + (cells_[0] + 1) * (at[1] + (cells_[1] + 1) * at[2]);
    const int a = node.axis, b = after(a, 1), c = after(a, 2);
    return first_[a] + 2 * (at[a] + cells_[a] * (at[b] + (cells_[b] + 1) * at[c])) + std::uint64_t(node.third);
  }

  Node nodeOf(std::uint64_t number) const {
    const auto divided = [](std::uint64_t& rest, std::uint64_t by) {
      const std::uint64_t remainder = rest % by;
      rest /= by;
      return remainder;
    };
    Node node{};
    if (number < first_[0]) {
      for (int axis = 0; axis < 3; ++axis) node.place[axis] = divided(number, cells_[axis] + 1);
      return node;
    }
    node.axis = number < first_[1] ? 0 : number < first_[2] ? 1 : 2;
    number -= first_[node.axis];
    node.third = int(divided(number, 2));
    node.place[node.axis] = divided(number, cells_[node.axis]);
    node.place[after(node.axis, 1)] = divided(number, cells_[after(node.axis, 1)] + 1);
    node.place[after(node.axis, 2)] = number;
    return node;
  }

  static int after(int axis, int steps) { return (axis + steps) % 3; }

 private:
  Place cells_;
  std::array<std::uint64_t, 4> first_{};  // number of the first node on an edge along each axis; of all nodes
};

/// The n-th node of the cell with this lower corner: corners 0 to 7, n = x + 2y + 4z, then the nodes on edges along x,
/// along y and along z. Of the four edges along axis a, those apart along a+2 are neighbours.
Node nodeOfCell(Place corner, int n) {
  if (n < 8) {
    for (int axis = 0; axis < 3; ++axis) corner[axis] += n >> axis & 1;
    return {corner};
  }
  const int axis = (n - 8) / 8, edge = n / 2 % 4;
  corner[Numbering::after(axis, 2)] += edge & 1;
  corner[Numbering::after(axis, 1)] += edge >> 1;
  return {corner, axis, n % 2};
}

/// Where a grid's nodes lie, by the same operations as the loaders': a cell's lower corner first.
Vector3 positionOf(const Node& node, const Vector3& lower, const Vector3& cellSize) {
  Vector3 x = lower;
  for (int axis = 0; axis < 3; ++axis) x[axis] += cellSize[axis] * static_cast<double>(node.place[axis]);
  if (node.axis >= 0) x[node.axis] += (1 + node.third) / 3.0 * cellSize[node.axis];
  return x;
}

/// The cubic serendipity polynomial that is 1 at a cell's n-th node and 0 at its others, at local coordinates in
/// [-1, 1].
double shape(int n, const Vector3& local) {
  const Node node = nodeOfCell({0, 0, 0}, n);
  double product = 1;
  for (int axis = 0; axis < 3; ++axis)
    if (axis != node.axis) product *= node.place[axis] == 0 ? 1 - local[axis] : 1 + local[axis];
  if (node.axis < 0) return product * (9 * local.squaredNorm() - 19) / 64;
  const double t = local[node.axis];
  return product * (1 - t * t) * (node.third == 0 ? 1 - 3 * t : 1 + 3 * t) * 9 / 64;
}

void checkResolution(const GridResolution& resolution) {
  if (std::ranges::find(resolution, 0u) != resolution.end())
    throw Error("a grid without cells; give at least one cell along each axis");
  const double bytes = cubicGridBytes(resolution);
  if (bytes <= double(kMostCubicGridBytes)) return;
  std::ostringstream message;
  message << "a grid of " << resolution[0] << " x " << resolution[1] << " x " << resolution[2] << " cells takes "
          << std::uint64_t(std::min(std::ceil(bytes / 1e6), 1e18))
          << " MB as a file, of which Bullet's loader reads 2147 at most;"
          << " give fewer cells";
  throw Error(message.str());
}

template <typename T>
void putAll(OutputFile& out, std::span<const T> values) {
  out.write(std::as_bytes(values));
}
void putSize(OutputFile& out, std::uint64_t size) { putAll(out, std::span<const std::uint64_t>(&size, 1)); }
void putVector(OutputFile& out, const Vector3& v) { putAll(out, std::span<const double>(v.data(), 3)); }

/// The nodes of a row of cells along x.
void numberRow(const Numbering& numbering, std::uint32_t cells, std::uint64_t y, std::uint64_t z,
               std::vector<std::uint32_t>& row) {
  row.clear();
  for (std::uint64_t x = 0; x < cells; ++x)
    for (int n = 0; n < kNodesOfCell; ++n)
      row.push_back(static_cast<std::uint32_t>(numbering.numberOf(nodeOfCell({x, y, z}, n))));
}

}  // namespace

double CubicGrid::value(const Vector3& x) const {
  const Vector3 size = cellSize();
  Place cell;
  for (int axis = 0; axis < 3; ++axis) {
    const double at = (x[axis] - domain.min()[axis]) / size[axis];
    cell[axis] = static_cast<std::uint64_t>(std::clamp(at, 0.0, double(resolution[axis] - 1)));
  }
  const Vector3 lower = positionOf({cell}, domain.min(), size);
  const Vector3 local = 2 * (x - lower).cwiseQuotient(size) - Vector3::Ones();
  const Numbering numbering(resolution);
  double sum = 0;
  for (int n = 0; n < kNodesOfCell; ++n) sum += nodes[numbering.numberOf(nodeOfCell(cell, n))] * shape(n, local);
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
    throw Error("not even a single cell fits into " + std::to_string(bytes) + " bytes; give " +
                std::to_string(static_cast<std::uint64_t>(cubicGridBytes({1, 1, 1}))) + " at least");
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
      for (std::size_t n = 0; n < count; ++n) points[n] = positionOf(numbering.nodeOf(first + n), lower, cellSize);
      field.values(points, std::span(grid.nodes).subspan(first, count));
    };
    forEachChunk(grid.nodes.size(), kChunk, progress, "sampling", sample);
  });
  return grid;
}

CubicGridError measureCubicGrid(const CubicGrid& grid, const Field& field, std::size_t points, std::uint64_t seed,
                                int threads, const Progress& progress) {
  struct Both {
    Sums everywhere, nearSurface;
  };
  const double near = grid.cellSize().norm();
  std::vector<Both> parts(chunksOf(points, kChunk));
  withThreads(threads, [&] {
    forEachChunk(points, kChunk, progress, "measuring", [&](std::size_t chunk, std::size_t first, std::size_t count) {
      std::vector<Vector3> at(count);
      std::vector<double> values(count);
      for (std::size_t n = 0; n < count; ++n) at[n] = Random(seed, first + n).inBox(grid.domain);
      field.values(at, values);
      for (std::size_t n = 0; n < count; ++n) {
        const double difference = std::abs(grid.value(at[n]) - values[n]);
        parts[chunk].everywhere.add(difference);
        if (std::abs(values[n]) <= near) parts[chunk].nearSurface.add(difference);
      }
    });
  });
  Both all;
  for (const Both& part : parts) {
    all.everywhere.add(part.everywhere);
    all.nearSurface.add(part.nearSurface);
  }
  const auto figures = [](const Sums& of) { return GridDifference{of.count, of.rms(), of.max}; };
  return {figures(all.everywhere), figures(all.nearSurface), near};
}

void writeCubicGrid(const CubicGrid& grid, OutputFile& out, const Progress& progress) {
  checkResolution(grid.resolution);
  const Numbering numbering(grid.resolution);
  if (grid.nodes.size() != numbering.count())
    throw Error("a grid with " + std::to_string(grid.nodes.size()) + " nodes instead of " +
                std::to_string(numbering.count()) + "; sample it anew");
  const auto& [nx, ny, nz] = grid.resolution;
  const std::uint64_t cells = std::uint64_t{nx} * ny * nz;
  putVector(out, grid.domain.min());
  putVector(out, grid.domain.max());
  putAll(out, std::span<const std::uint32_t>(grid.resolution));
  putVector(out, grid.cellSize());
  putVector(out, grid.cellSize().cwiseInverse());
  putSize(out, cells);
  putSize(out, 1);  // fields

  putSize(out, 1);  // lists of nodes, one a field
  putSize(out, grid.nodes.size());
  putAll(out, std::span<const double>(grid.nodes));

  putSize(out, 1);  // lists of cells
  putSize(out, cells);
  Parts parts(progress, "writing", std::size_t{ny} * nz);
  std::vector<std::uint32_t> row;
  for (std::uint32_t z = 0; z < nz; ++z)
    for (std::uint32_t y = 0; y < ny; ++y) {
      parts.begin();
      numberRow(numbering, nx, y, z, row);
      putAll(out, std::span<const std::uint32_t>(row));
      parts.end();
    }

  putSize(out, 1);  // lists of where in the list of cells each cell is: none is left out
  putSize(out, cells);
  std::vector<std::uint32_t> places(cells);
  std::iota(places.begin(), places.end(), 0u);
  putAll(out, std::span<const std::uint32_t>(places));
  out.flush();
}

}  // namespace hpsdf
