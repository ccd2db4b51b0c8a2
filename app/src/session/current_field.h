#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "hpsdf/field.h"

namespace hpsdf::app {

/// The field that commands work on.
struct CurrentField {
  Field field;
  std::string name;                              ///< file or mesh that it came from
  std::optional<std::uintmax_t> fileBytes = {};  ///< of one that was loaded or saved
  std::string surface = {};                      ///< mesh file or shape that it was built from just now

  /// What it can be built from again: as far as is known.
  const std::string& madeFrom() const { return surface.empty() ? field.metadata().source.name : surface; }
};

}  // namespace hpsdf::app
