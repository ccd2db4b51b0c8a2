#pragma once

#include <filesystem>

#include "hpsdf/field.h"

namespace hpsdf {

/// Writes a `.hpsdf` file (docs/file-format.md): versioned, little-endian, checksummed; the same field gives the same
/// bytes. Written under a temporary name beside `file` and renamed, so that an interrupted save leaves the old file.
/// Throws `Error` naming the file and the reason.
void save(const Field& field, const std::filesystem::path& file);

/// Reads what `save` wrote. Every size is checked against the file's length before memory is taken.
/// Throws `Error` for a file that is missing, foreign, of another version, truncated or altered.
Field load(const std::filesystem::path& file);

}  // namespace hpsdf
