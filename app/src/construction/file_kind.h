#pragma once
// Tells whether a file or a name stands for a field, for a surface from which a field can be built, or for neither.

#include <cstdint>
#include <string>

#include "hpsdf/error.h"

namespace hpsdf::app {

enum class FileKind : std::uint8_t { field, surface, unknown };

/// Tells what `name` stands for. A shape's name, such as builtin:torus, is a surface. A file that can be read is a
/// field if it begins as field files do. All other names, also those of files that do not exist yet, are told apart by
/// their ends.
FileKind kindOfFile(const std::string& name);

/// Returns the error for an existing file of the kind `FileKind::unknown`. It names the kinds of files that the program
/// opens.
Error unknownKind(const std::string& name);

}  // namespace hpsdf::app
