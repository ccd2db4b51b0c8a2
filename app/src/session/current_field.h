#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "hpsdf/field.h"

namespace hpsdf::app {

/// The current field of a session. Commands read and change it.
struct CurrentField {
  Field field;
  std::string name;                              ///< name of the file or mesh that the field came from
  std::optional<std::uintmax_t> fileBytes = {};  ///< size of the field's file, if it was loaded or saved
  std::string surface = {};                      ///< mesh file or shape, if the field was built in this session

  /// Returns the mesh file or shape from which the field can be built again, or "" if the surface is unknown.
  const std::string& madeFrom() const { return surface.empty() ? field.metadata().source.name : surface; }
};

/// Loads a field file. A file that would take more than half of the memory that the process may take is mapped, if it
/// can be (`Loading::mapped`). Throws `Error` naming the file.
Field loadOrMap(const std::filesystem::path& file);

}  // namespace hpsdf::app
