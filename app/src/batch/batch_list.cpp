#include "batch/batch_list.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <sstream>
#include <unordered_set>

#include "hpsdf/error.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
constexpr std::size_t kLongestReadable = 100;  // bytes; file systems allow 255 with number and suffixes

/// Turns the name of a mesh into a readable file name: "torus_major_0.7" for builtin:torus,major=0.7, and "bunny" for
/// scans/bunny.obj.
std::string readableName(std::string surface) {
  std::ranges::replace(surface, ',', '_');  // `plainName` cuts the name at a comma
  std::string name = plainName(surface).substr(0, kLongestReadable);
  if (name.starts_with('.')) name[0] = '_';  // a leading dot would hide the file
  return name;
}

}  // namespace

std::vector<BatchMesh> parseBatchList(std::string_view text) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  std::vector<BatchMesh> meshes;
  std::unordered_set<std::string> known;
  std::istringstream lines{std::string(text)};
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.find('\0') != std::string::npos)
      throw Error(fmt::format("line {} holds a zero byte: expected one name a line, in UTF-8", number));
    const std::string surface(trimmed(line));
    if (surface.empty() || surface.starts_with('#') || !known.insert(surface).second) continue;
    const std::uint64_t hash = XXH3_64bits(surface.data(), surface.size());
    meshes.push_back({surface, hash, fmt::format("{}-{:016x}", readableName(surface), hash)});
  }
  return meshes;
}

}  // namespace hpsdf::app
