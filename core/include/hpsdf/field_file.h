#pragma once

#include <cstdint>
#include <filesystem>

#include "hpsdf/field.h"

namespace hpsdf {

struct SaveOptions {
  /// Compresses the arrays, without loss. The file is smaller, and loads into the same bytes of memory; saving takes
  /// longer, because several forms of the arrays are compressed as far as possible. Equal fields give equal bytes with
  /// the same version of zstd.
  bool compress = false;
};

/// Writes a field as a `.hpsdf` file (docs/file-format.md), which is versioned, little-endian and checksummed.
/// Equal fields give equal bytes. The file is written under a temporary name in the same folder and then
/// renamed, so that an interrupted save leaves an older file intact. A symbolic link is followed and stays, also if the
/// file to which it leads does not exist yet. Throws `Error` with a message that names
/// the file and the reason.
void save(const Field& field, const std::filesystem::path& file, const SaveOptions& options = {});

/// The memory into which `load` puts the coefficients of a field, which take most of its bytes.
enum class Loading : std::uint8_t {
  resident,  ///< memory of the process; the whole file is read and checked
  /// Pages of the file that the operating system reads when they are needed and drops when memory is short, so that
  /// fields can be larger than the memory. Coefficients are checked when they are first needed, in blocks of 64 KiB
  /// with a checksum each: queries and all else that reads them can throw `Error` (of the kind `file`). The octree,
  /// bounds and triangles are read and checked at once. The file must not be changed as long as the field or a copy of
  /// it exists: where it has become shorter, or the disk fails, the system ends the process with the signal SIGBUS. To
  /// save to it is safe, because `save` makes a new file. Compressed files and those of versions before 12
  /// cannot be mapped.
  mapped,
};

/// Reads the field from a file that `save` wrote. Compressed files need no option. Sizes are checked before memory is
/// allocated: against the file's length or, of compressed arrays, against what so many bytes can hold, and against the
/// memory that the process may take. Throws `Error` if the file is missing, is truncated, is altered, has an
/// unknown version, is not a `.hpsdf` file, or cannot be loaded in the asked way.
Field load(const std::filesystem::path& file, Loading loading = Loading::resident);

/// Tells whether `Loading::mapped` can load a file. Returns false for a file that cannot be read.
bool canBeMapped(const std::filesystem::path& file);

/// Tells whether a file begins as files that `save` wrote do. Returns false for a file that cannot be read.
bool isFieldFile(const std::filesystem::path& file);

}  // namespace hpsdf
