#pragma once
// Readers of grid files. Their arguments are the bytes of a whole file; they throw `Error` with the problem alone.

#include <cstring>
#include <string_view>

#include "hpsdf/output/grids.h"

namespace hpsdf::grids {

RegularGrid readVti(std::string_view bytes);
RegularGrid readNpy(std::string_view bytes);

/// Returns the number that the bytes of a little-endian number hold. They may be unaligned.
template <typename Number>
Number numberAt(const char* bytes) {
  Number number;
  std::memcpy(&number, bytes, sizeof(number));
  return number;
}

}  // namespace hpsdf::grids
