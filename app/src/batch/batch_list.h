#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hpsdf::app {

/// One mesh of a list of meshes.
struct BatchMesh {
  std::string surface;  ///< the line of the list: a file, builtin:… or analytic:…
  std::string name;     ///< base name of the mesh's output files: a readable part and a hash of `surface`
};

/// Parses a list that names one mesh per line. Blanks around a name, empty lines, lines that begin with # and
/// repeated lines are ignored. Different lines give different output file names. The output file name of a mesh
/// depends only on the mesh's line, so it stays the same when the list grows. Throws `Error` for a line with a zero
/// byte: the list is then not text with one name per line, but for instance the output of `find -print0` or UTF-16.
std::vector<BatchMesh> parseBatchList(std::string_view text);

/// Returns the meshes of one of several parts of a list. `part` is "K/N": the K-th of N parts, which holds every N-th
/// mesh from the K-th on. Every mesh is in one part. Throws `Error` for any other text.
std::vector<BatchMesh> partOf(const std::vector<BatchMesh>& meshes, std::string_view part);

/// Throws the `Error` that `partOf` would throw for the text `part`.
void checkPart(std::string_view part);

}  // namespace hpsdf::app
