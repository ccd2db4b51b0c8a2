#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hpsdf::app {

/// One mesh of a list.
struct BatchMesh {
  std::string surface;       ///< the line of the list: a file, builtin:… or analytic:…
  std::uint64_t number = 0;  ///< hash of `surface`, which identifies the mesh
  std::string name;          ///< base name of its files: a readable part and the number
};

/// Parses a list that names one mesh a line. Blanks around a name, empty lines, lines that begin with # and repetitions
/// are ignored. File names depend on the line alone, so that they stay when the list grows, and differ where lines do.
/// Throws `Error` for a line with a zero byte, as `find -print0` and UTF-16 produce them: its names would be lost.
std::vector<BatchMesh> parseBatchList(std::string_view text);

}  // namespace hpsdf::app
