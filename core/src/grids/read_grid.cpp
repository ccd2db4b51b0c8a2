#include "grids/read_grid.h"

#include "grids/grid_memory.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/text.h"
#include "hpsdf/input/grid_distance.h"
#include "mesh/scan/input.h"

namespace hpsdf {
namespace {

/// Returns the bytes of a file. Throws `Error` if it cannot be read or does not fit into memory.
std::string wholeFile(const std::filesystem::path& file) {
  const Progress progress;
  mesh::Input input(file, progress);
  requireMemory("the file " + file.string(), double(input.mostLeft()), grids::kCoarserGrid);
  std::string bytes;
  bytes.reserve(input.mostLeft());
  while (input.ensure(1)) {
    bytes += input.rest();
    input.skip(input.rest().size());
  }
  return bytes;
}

}  // namespace

bool isRegularGridName(const std::filesystem::path& file) {
  const std::string extension = lowerExtension(file);
  return extension == ".vti" || extension == ".npy";
}

RegularGrid loadGrid(const std::filesystem::path& file) {
  const std::string bytes = wholeFile(file);
  try {
    return lowerExtension(file) == ".npy" ? grids::readNpy(bytes) : grids::readVti(bytes);
  } catch (const Error& error) {
    throw Error(error.kind() == ErrorKind::general ? ErrorKind::file : error.kind(), file.string(), error.what());
  }
}

}  // namespace hpsdf
