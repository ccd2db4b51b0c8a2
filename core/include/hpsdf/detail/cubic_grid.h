#pragma once
// Regular grids of cubic cells, written as `.cdf` files in the format of Discregrid. Bullet's `btMiniSDF` and
// PositionBasedDynamics load these files (docs/export.md).

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// Greatest size of a `.cdf` file in bytes. Bullet's loader counts the bytes of a file in an int.
constexpr std::uint64_t kMaxCubicGridBytes = 2147483647;

/// Number of cells along x, y and z.
using GridResolution = std::array<std::uint32_t, 3>;

/// Distances at the nodes of a grid of equal cells that fill a box. A cell has 32 nodes: its 8 corners, and two
/// nodes at the thirds of each edge. Cubic serendipity polynomials interpolate between the nodes. The
/// interpolation reproduces polynomials of degree 3; its error is of the fourth order in the cell size. The
/// interpolated values are continuous, because neighbouring cells share nodes; their gradients are not.
struct CubicGrid {
  Box domain;
  GridResolution resolution = {1, 1, 1};
  /// Distances at the nodes in the field's units, negative inside. The corners of the cells come first, x fastest; then
  /// follow the nodes on edges along x, along y and along z. Among the edges along axis a, coordinate a varies fastest,
  /// then a+1, then a+2 (cyclic). The two nodes of an edge are adjacent; the node with the lower coordinate is first.
  std::vector<double> nodes;

  Vector3 cellSize() const {
    return domain.sizes().cwiseQuotient(Vector3(resolution[0], resolution[1], resolution[2]));
  }

  /// Returns the interpolated distance at x, which must lie in the domain. Programs that load the `.cdf` file
  /// interpolate in the same way.
  double value(const Vector3& x) const;
};

/// Returns the size in bytes of the `.cdf` file of a grid with this resolution. The size is exact up to
/// `kMaxCubicGridBytes`.
double cubicGridBytes(const GridResolution& resolution);

/// Returns the resolution with `alongLongest` cells along the domain's longest side and with nearly cubic cells.
GridResolution cubicGridResolution(const Box& domain, std::uint32_t alongLongest);

/// Returns the finest resolution with nearly cubic cells whose file has at most `bytes` bytes. Throws `Error`
/// if the file of a single cell is larger.
GridResolution finestCubicGrid(const Box& domain, std::uint64_t bytes);

/// Samples a field at the nodes of a grid that fills the field's domain. The result does not depend on
/// `threads` (0: all that the machine offers). Throws `Error`, before memory is allocated, if an axis has no
/// cells or the file would be longer than `kMaxCubicGridBytes`. Throws `Cancelled` when `progress` says so.
CubicGrid sampleCubicGrid(const Field& field, const GridResolution& resolution, int threads = 0,
                          const Progress& progress = {});

/// Statistics of the difference |grid − f| between a grid's interpolation and the field f, over a set of points. All
/// values are 0 if there are no points.
struct GridDifference {
  std::size_t points = 0;
  double rms = 0;
  double max = 0;
};

/// The interpolation error of a grid: its difference from the field f. The error of f itself is not included.
struct CubicGridError {
  GridDifference everywhere;
  GridDifference nearSurface;  ///< difference over the points at which |f| ≤ `near`
  double near = 0;             ///< greatest |f| of a point near the surface: the length of a cell's diagonal
};

/// Compares a grid with the field from which the grid was sampled, at `points` random points that are uniform
/// in the domain. The result depends on `seed`, not on `threads`. Throws `Cancelled` when `progress` says so.
CubicGridError measureCubicGrid(const CubicGrid& grid, const Field& field, std::size_t points, std::uint64_t seed = 1,
                                int threads = 0, const Progress& progress = {});

/// Writes a grid in the `.cdf` format to `out` and flushes `out`; the caller commits the file. Throws `Error`
/// for a resolution that `sampleCubicGrid` refuses, if the number of nodes does not match the resolution, and
/// as `OutputFile::write` does. Throws `Cancelled` when `progress` says so.
void writeCubicGrid(const CubicGrid& grid, OutputFile& out, const Progress& progress = {});

}  // namespace hpsdf
