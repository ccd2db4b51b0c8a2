#include "util/machine_memory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

namespace hpsdf::detail {
namespace {

namespace fs = std::filesystem;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

/// The number that the file holds; "max", or no file, means no limit.
double limitIn(const fs::path& file) {
  std::ifstream text(file);
  double bytes = 0;
  return text >> bytes ? bytes : kNoLimit;
}

/// The least limit in the files of this name from a group's folder up to the root of the groups. Within a container the
/// group's own folder may be invisible; the topmost visible folder is then the container's.
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
  // A line is number:controllers:group, with no controllers in version 2.
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

double machineMemory() {
  static const double bytes =
      std::min(double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE)), memoryOfControlGroups());
  return bytes;
}

}  // namespace hpsdf::detail
