#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hpsdf::app {

/// One of many meshes.
struct BatchMesh {
  std::string surface;       ///< as the list has it: a file, builtin:… or analytic:…
  std::uint64_t number = 0;  ///< hash of `surface`: tells it from all others
  std::string name;          ///< for files, without an extension: something readable, and the number
};

/// What a list names, a mesh a line, each once; blanks around it do not count, nor do empty lines and those that begin
/// with #. Names depend on the line alone, so that they stay when the list grows, and differ where lines do.
/// Throws `Error` for a line with a zero byte, as of `find -print0` or in UTF-16: names would be lost.
std::vector<BatchMesh> parseBatchList(std::string_view text);

}  // namespace hpsdf::app
