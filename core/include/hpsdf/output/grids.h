#pragma once
// Regular grids of a field's values, and files by which other programs read these grids or the field's leaves.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// The positions of a regular grid's points: point (i, j, k) lies at origin + (i, j, k) · spacing, in the field's
/// units.
struct GridLayout {
  std::array<std::uint32_t, 3> points = {1, 1, 1};  ///< numbers of points along x, y and z
  Vector3 origin = Vector3::Zero();
  Vector3 spacing = Vector3::Ones();

  std::size_t count() const { return std::size_t{points[0]} * points[1] * points[2]; }
  Vector3 position(std::size_t i, std::size_t j, std::size_t k) const {
    return origin + Vector3(double(i), double(j), double(k)).cwiseProduct(spacing);
  }
  /// Returns the box that the points span.
  Box box() const { return Box(origin, position(points[0] - 1, points[1] - 1, points[2] - 1)); }
};

/// Returns a grid whose outermost points are the corners of `box`, with this number of cells along x, y and z and hence
/// one more point.
GridLayout gridOfCells(const Box& box, const std::array<std::uint32_t, 3>& cells);

/// Returns the grid of the points in `box` whose coordinates are multiples of `voxel`, as those of an OpenVDB grid with
/// this voxel size are. Throws `Error` if `voxel` is not positive, if the box holds no such point, or if the grid
/// has more points than memory can hold.
GridLayout gridOfVoxels(const Box& box, double voxel);

/// Values at the points of a regular grid, with x fastest, then y, then z.
struct RegularGrid {
  GridLayout layout;
  std::vector<double> values;      ///< distances in the field's units, negative inside
  std::vector<Vector3> gradients;  ///< one for each point, or empty
};

/// Samples a field, and its gradient if `withGradients` is true. Points outside the domain get the values by which the
/// field is continued. The result does not depend on `threads` (0: all that the machine offers). Throws `Error` (of the
/// kind `limit`), before memory is allocated, if the grid would not fit into memory, and `Cancelled` when `progress`
/// says so.
RegularGrid sampleGrid(const Field& field, const GridLayout& layout, bool withGradients, int threads = 0,
                       const Progress& progress = {});

/// The type of the numbers in a file.
enum class NumberType : std::uint8_t { float32, float64 };

/// Writes a grid as image data in the XML format of VTK (`.vti`), which ParaView reads: the points' scalars "distance"
/// and, if the grid has gradients, their vectors "gradient". The numbers are little-endian and compressed by zlib.
/// Flushes `out`; the caller commits the file. Throws `Error` as `OutputFile::write` does, and `Cancelled` when
/// `progress` says so. Source: "VTK XML Formats", docs.vtk.org.
void writeVti(const RegularGrid& grid, NumberType type, OutputFile& out, const Progress& progress = {});

/// Writes a grid's values as an array that NumPy reads (`.npy`), with the shape (nz, ny, nx) or, with gradients,
/// (nz, ny, nx, 4), which holds the value and then the gradient. The file does not tell origin and spacing. Flushes
/// `out`. Throws as `writeVti` does.
void writeNpy(const RegularGrid& grid, NumberType type, OutputFile& out, const Progress& progress = {});

/// The choices for a file of a field's leaves.
struct LeafCellOptions {
  /// Order of the cells' polynomials, 1 to `kMaxLagrangeOrder`. With 1, the leaves are voxels with values at their
  /// corners. Otherwise they are Lagrange hexahedra of the leaf's degree or, if that is greater, of this order: a leaf
  /// of at most this degree keeps its polynomial.
  int order = 1;
  NumberType type = NumberType::float32;
  int threads = 0;  ///< greatest number of threads, 0 for all; the file does not depend on it
};

/// The greatest order of a Lagrange cell that VTK 9.1 reads.
constexpr int kMaxLagrangeOrder = 10;

/// Writes a field's leaves as an unstructured grid in the XML format of VTK (`.vtu`). The cells have the data "degree"
/// (`kExactDegree` for exact leaves), "depth", "error" and "jump". The error is √(ε_e / V) with the squared error ε_e
/// (`Cell::error`) and the volume V of the leaf: the leaf's estimated RMS error. The jump is the greatest one on the
/// leaf's faces (`worstJumpOfCells`). The points have the data "distance". Leaves share no points: at its corners each
/// leaf has the values of its own polynomial, so that jumps are visible. Flushes `out`. Throws `Error` (of the kind
/// `limit`) if the cells would not fit into memory, and otherwise as `writeVti` does.
void writeVtu(const Field& field, const LeafCellOptions& options, OutputFile& out, const Progress& progress = {});

}  // namespace hpsdf
