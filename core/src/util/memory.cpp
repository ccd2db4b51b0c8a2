#include "hpsdf/detail/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string>

#include "hpsdf/error.h"

namespace hpsdf {
namespace detail {
namespace {

namespace fs = std::filesystem;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

/// Returns the number in the file. Returns `kNoLimit` if the file holds "max" or does not exist.
double limitIn(const fs::path& file) {
  std::ifstream text(file);
  double bytes = 0;
  return text >> bytes ? bytes : kNoLimit;
}

/// Returns the lowest memory limit of a Linux control group and of the groups above it, read from the file named `file`
/// in each group's folder. Within a container the folder of the control group may be invisible. In that case the
/// topmost visible folder belongs to the container.
double leastLimit(const fs::path& groups, fs::path group, const char* file) {
  double least = kNoLimit;
  for (;; group = group.parent_path()) {
    least = std::min(least, limitIn(groups / group.relative_path() / file));
    if (!group.has_relative_path()) return least;
  }
}

}  // namespace

double memoryOfControlGroups(const fs::path& root) {
  const fs::path groups = root / "sys/fs/cgroup";
  std::ifstream lines(root / "proc/self/cgroup");
  double least = kNoLimit;
  // Each line has the form number:controllers:group. In version 2 of control groups, controllers is empty.
  for (std::string line; std::getline(lines, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const fs::path group = fs::path(line.substr(second + 1)).lexically_normal();
    if (controllers == ",,") least = std::min(least, leastLimit(groups, group, "memory.max"));
    if (controllers.find(",memory,") != std::string::npos)
      least = std::min(least, leastLimit(groups / "memory", group, "memory.limit_in_bytes"));
  }
  return least;
}

double addressLimit() {
  rlimit limit{};
  return getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY ? double(limit.rlim_cur) : kNoLimit;
}

double machineMemory() {
  static const double bytes =
      std::min(double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE)), memoryOfControlGroups());
  return bytes;
}

}  // namespace detail

double allowedMemory() { return 0.75 * std::min(detail::machineMemory(), detail::addressLimit()); }

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
                  " that are three quarters of what the machine, its control group or 'ulimit -v' allows: " +
                  std::string(advice));
}

}  // namespace hpsdf
