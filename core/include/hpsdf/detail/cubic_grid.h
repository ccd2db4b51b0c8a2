#pragma once
// A field on a regular grid of cubic cells: the `.cdf` files of Discregrid, which Bullet's `btMiniSDF` and
// PositionBasedDynamics load. See docs/export.md.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// Bytes of the longest `.cdf` file: Bullet's loader counts them in an int.
constexpr std::uint64_t kMostCubicGridBytes = 2147483647;

/// Cells along x, y and z.
using GridResolution = std::array<std::uint32_t, 3>;

/// Distances at the nodes of equal cells that fill a box. A cell has 32 nodes, its corners and two on each edge at the
/// thirds, and is interpolated by cubic serendipity polynomials: exact for polynomials of degree 3, otherwise wrong by
/// the fourth power of a cell's size. Neighbours share nodes, so that values are continuous; gradients are not.
struct CubicGrid {
  Box domain;
  GridResolution resolution = {1, 1, 1};
  /// In the field's units, negative inside: the cells' corners, x fastest, then y, then z; then the nodes on edges
  /// along x, along y and along z. Of the edges along axis a those with the same place on axes a+1 and a+2 (cyclic)
  /// stand together, then a+1 goes on, then a+2; the two nodes of an edge are neighbours, the lower first.
  std::vector<double> nodes;

  Vector3 cellSize() const {
    return domain.sizes().cwiseQuotient(Vector3(resolution[0], resolution[1], resolution[2]));
  }

  /// What the loaders interpolate at x, which must lie in the domain: they have no value outside.
  double value(const Vector3& x) const;
};

/// Bytes of the file of such a grid; exact as long as `kMostCubicGridBytes` allows it.
double cubicGridBytes(const GridResolution& resolution);

/// So many cells along the longest side, so many along the others that cells are as good as cubes.
GridResolution cubicGridResolution(const Box& domain, std::uint32_t alongLongest);

/// The finest of these whose file has at most `bytes` bytes. Throws `Error` where not even the coarsest has.
GridResolution finestCubicGrid(const Box& domain, std::uint64_t bytes);

/// Takes a field's values at a grid's nodes, which fills its domain. The same for any number of `threads` (0: all that
/// the machine offers). Throws `Error`, before memory is taken, for no cells along an axis or where the file would be
/// longer than `kMostCubicGridBytes`; `Cancelled` when progress says so.
CubicGrid sampleCubicGrid(const Field& field, const GridResolution& resolution, int threads = 0,
                          const Progress& progress = {});

/// |grid − f| over points; 0 where there is none.
struct GridDifference {
  std::size_t points = 0;
  double rms = 0;
  double max = 0;
};

/// What interpolation adds to a field's own error.
struct CubicGridError {
  GridDifference everywhere;
  GridDifference nearSurface;  ///< of those points at which |f| ≤ `near`
  double near = 0;             ///< the diagonal of a cell
};

/// Compares a grid with the field that it was made from, at `points` points that are uniform in the domain. The same
/// `seed` gives the same figures, whatever the number of `threads`. Throws `Cancelled` when progress says so.
CubicGridError measureCubicGrid(const CubicGrid& grid, const Field& field, std::size_t points, std::uint64_t seed = 1,
                                int threads = 0, const Progress& progress = {});

/// Appends the bytes of a `.cdf` file and flushes; to commit is left to the caller. Throws `Error` for a grid that
/// `sampleCubicGrid` would have refused or that has another number of nodes than its cells ask for, and as
/// `OutputFile::write` does; `Cancelled` when progress says so.
void writeCubicGrid(const CubicGrid& grid, OutputFile& out, const Progress& progress = {});

}  // namespace hpsdf
