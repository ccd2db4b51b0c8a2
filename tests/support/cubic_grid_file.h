#pragma once

#include <fstream>
#include <iterator>
#include <string>

#include "hpsdf/detail/cubic_grid.h"
#include "support/temporary_directory.h"

namespace hpsdf {

/// Returns the bytes of the file that writeCubicGrid writes.
inline std::string fileOf(const CubicGrid& grid) {
  const support::TemporaryDirectory folder;
  OutputFile out(folder / "grid.cdf");
  writeCubicGrid(grid, out);
  out.commit();
  std::ifstream stream(folder / "grid.cdf", std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace hpsdf
