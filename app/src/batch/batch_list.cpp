#include "batch/batch_list.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
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

/// A part of a list: the `number`-th of `count` parts, where 1 is the first.
struct Part {
  std::size_t number;
  std::size_t count;
};

/// Parses all of `text` as a whole number. Returns std::nullopt if it is anything else.
std::optional<std::size_t> partNumber(std::string_view text) {
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

Part parsePart(std::string_view text) {
  const std::size_t slash = text.find('/');
  if (slash != std::string_view::npos) {
    const auto number = partNumber(text.substr(0, slash)), count = partNumber(text.substr(slash + 1));
    if (number && count && *number >= 1 && *number <= *count) return {*number, *count};
  }
  throw Error(fmt::format(
      "part: '{}' is no part of a list: expected K/N with K from 1 to N, such as 1/20 for the first of twenty parts",
      text));
}

}  // namespace

void checkPart(std::string_view part) { parsePart(part); }

std::vector<BatchMesh> partOf(const std::vector<BatchMesh>& meshes, std::string_view part) {
  const auto [number, count] = parsePart(part);
  std::vector<BatchMesh> chosen;
  for (std::size_t i = number - 1; i < meshes.size(); i += count) chosen.push_back(meshes[i]);
  return chosen;
}

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
    meshes.push_back({surface, fmt::format("{}-{:016x}", readableName(surface), hash)});
  }
  return meshes;
}

}  // namespace hpsdf::app
