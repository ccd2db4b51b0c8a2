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

/// Parses a list that names one mesh per line. Blanks around a name, empty lines, lines that begin with # and
/// repetitions are ignored. The file names of a mesh depend on its line alone, so that they stay the same when the
/// list grows, and they differ between different lines. Throws `Error` for a line with a zero byte, as in the
/// output of `find -print0` and in UTF-16, because the names in it would be lost.
std::vector<BatchMesh> parseBatchList(std::string_view text);

}  // namespace hpsdf::app
