#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hpsdf::app {

/// One mesh of a list of meshes.
struct BatchMesh {
  std::string surface;       ///< the line of the list: a file, builtin:… or analytic:…
  std::uint64_t number = 0;  ///< hash of `surface`, which identifies the mesh
  std::string name;          ///< base name of the mesh's output files: a readable part and the number
};

/// Parses a list that names one mesh per line. Blanks around a name, empty lines, lines that begin with # and
/// repeated lines are ignored. Different lines give different output file names. The output file name of a mesh
/// depends only on the mesh's line, so it stays the same when the list grows. Throws `Error` for a line with a zero
/// byte: the list is then not text with one name per line, but for instance the output of `find -print0` or UTF-16.
std::vector<BatchMesh> parseBatchList(std::string_view text);

}  // namespace hpsdf::app
