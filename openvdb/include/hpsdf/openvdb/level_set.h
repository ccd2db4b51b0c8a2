#pragma once
// Level sets of OpenVDB and NanoVDB: voxels that hold the distances in a narrow band around a field's surface.

#include <cstddef>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf::vdb {

struct LevelSetOptions {
  double voxel = 0;      ///< edge of a voxel in the field's units; the voxels' values are those at multiples of it
  double halfWidth = 3;  ///< width of the band on each side of the surface, in voxels
  int threads = 0;       ///< greatest number of threads, 0 for all; the file does not depend on it
};

/// Figures of a level set.
struct LevelSetFigures {
  std::size_t activeVoxels = 0;  ///< voxels in the band
  std::size_t leafNodes = 0;     ///< blocks of 8 × 8 × 8 voxels that the grid stores
  std::size_t memoryBytes = 0;   ///< memory that OpenVDB's grid takes
};

/// Writes the level set of a field as an OpenVDB file (`.vdb`) with one grid "surface" of floats, of the class level
/// set. Its transform maps the index (i, j, k) to voxel · (i, j, k) in the field's units. Voxels in the band are active
/// and have the field's values; the others are inactive and have plus or minus the width of the band, by the sign of
/// the field. Where the solid reaches the boundary of the field's domain, the level set closes it outside of the
/// domain, as the field is continued there.
///
/// The field is evaluated only in blocks that certainly may hold a part of the band (`RangeIndex`). Flushes `out`; the
/// caller commits the file. Throws `Error` for options out of range, if the level set would not fit into memory, and
/// as `OutputFile::write` does. Throws `Cancelled` when `progress` says so.
LevelSetFigures writeVdb(const Field& field, const LevelSetOptions& options, OutputFile& out,
                         const Progress& progress = {});

/// Writes the same level set as a NanoVDB file (`.nvdb`), which is not compressed, so that programs can map it into
/// memory. Throws as `writeVdb` does.
LevelSetFigures writeNanoVdb(const Field& field, const LevelSetOptions& options, OutputFile& out,
                             const Progress& progress = {});

}  // namespace hpsdf::vdb
