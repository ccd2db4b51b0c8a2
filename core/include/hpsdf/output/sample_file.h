#pragma once
// Files of sample points for training programs, viewers and tables.

#include <cstdint>
#include <filesystem>

#include "hpsdf/output/sample_points.h"

namespace hpsdf {

/// The arrays of a .npz file. N is the number of points; numbers are floats unless doubles are asked for.
enum class SampleLayout : std::uint8_t {
  /// `points` (N, 3), `distances` (N,), `gradients` (N, 3), `kinds` (N,) as bytes with the numbers of `PointKind` and,
  /// unless the samples are those of a field, `closest` (N, 3), `faces` (N,) as 32-bit integers and `normals` (N, 3).
  arrays,
  /// The two arrays that DeepSDF's training reads: `pos` with the points whose distance is above 0 and `neg` with all
  /// others, of the shape (n, 4): x, y, z and the distance. The order of the points stays.
  deepSdf,
};

struct SampleFileOptions {
  SampleLayout layout = SampleLayout::arrays;  ///< `deepSdf` is for .npz files only
  bool doubles = false;                        ///< write numbers in double precision, not as floats
};

/// Writes samples to a file, whose extension tells the format:
/// - .npz: arrays that NumPy reads, see `SampleLayout`;
/// - .ply: binary PLY of vertices with the properties x, y, z, distance, gx, gy, gz, kind and, unless the samples are
///   those of a field, px, py, pz (the closest point), face, nx, ny, nz (its normal);
/// - .csv: text with the same columns, whose names are in the first line, in the shortest digits from which the same
///   numbers are read back.
///
/// The file appears whole or not at all, and its bytes depend only on samples and options. Throws `Error` for another
/// extension, for a layout that the format does not have, and if the file cannot be written.
void saveSamples(const SamplePoints& samples, const std::filesystem::path& file, const SampleFileOptions& options = {});

/// Throws the `Error` that `saveSamples` would throw for this file and these options, before the samples are computed.
void checkSamplesWritable(const std::filesystem::path& file, const SampleFileOptions& options = {});

}  // namespace hpsdf
