#include "hpsdf/detail/memory.h"

#include <array>
#include <cstdio>

#include "hpsdf/error.h"
#include "util/machine_memory.h"

namespace hpsdf {

double allowedMemory() { return 0.75 * detail::machineMemory(); }

std::string bytesText(double bytes) {
  struct Unit {
    double bytes;
    const char* format;
  };
  constexpr std::array<Unit, 4> kUnits = {{{1e9, "%.2f GB"}, {1e6, "%.2f MB"}, {1e3, "%.2f kB"}, {1, "%.0f bytes"}}};
  const Unit* unit = kUnits.begin();
  while (unit + 1 != kUnits.end() && bytes < unit->bytes) ++unit;
  std::array<char, 400> text{};  // The longest double has 309 digits before the point.
  std::snprintf(text.data(), text.size(), unit->format, bytes / unit->bytes);
  return text.data();
}

void requireMemory(const std::string& what, double bytes, std::string_view advice) {
  const double most = allowedMemory();
  if (bytes <= most) return;
  throw Error(ErrorKind::limit, "",
              what + " would take some " + bytesText(bytes) + " of memory, more than the " + bytesText(most) +
                  " that are three quarters of what the machine or its control group has: " + std::string(advice));
}

}  // namespace hpsdf
