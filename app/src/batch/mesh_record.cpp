#include "batch/mesh_record.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <system_error>
#include <vector>

#include "console/version.h"
#include "construction/build_arguments.h"
#include "construction/surface.h"
#include "files/text_file.h"
#include "hpsdf/error.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

/// Returns the checksum at the end of a field file without verifying it. Returns "" if the file is too short.
std::string checksumOf(const fs::path& field) {
  constexpr int kBytes = 8;
  std::array<char, kBytes> bytes{};
  std::ifstream file(field, std::ios::binary);
  file.seekg(-kBytes, std::ios::end).read(bytes.data(), kBytes);
  std::string text;
  for (const char byte : bytes) text += fmt::format("{:02x}", std::uint8_t(byte));
  return file ? text : std::string();
}

/// Returns the names of the explicitly given options that affect the field. Options given with their default value are
/// included, because every explicit option overrides the preset --paper.
Json givenNames(const Arguments& arguments) {
  Json names = Json::array();
  for (const Parameter& parameter : buildParameters())
    if (decides(parameter) && arguments.given(parameter.name)) names.push_back(parameter.name);
  return names;
}

Json linesJson(const std::string& text) {
  Json list = Json::array();
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) list.push_back(line);
  return list;
}

}  // namespace

Json readRecord(const fs::path& file) {
  std::error_code missing;
  if (!fs::is_regular_file(file, missing)) return nullptr;
  try {
    Json record = Json::parse(readTextFile(file.string()), nullptr, false);
    if (record.is_discarded()) return {{"status", kBegun}};
    return record.is_object() ? record : Json();
  } catch (const Error&) {
    return nullptr;
  }
}

void writeBegun(const fs::path& file, const std::string& surface, const fs::path& output, const Json& madeFrom) {
  if (fs::is_directory(file)) throw Error(ErrorKind::file, file.string(), "is a folder; give a file name");
  const Json record = {{"file", surface}, {"output", output.string()}, {"status", kBegun}, {kMadeFrom, madeFrom}};
  if (!(std::ofstream(file) << jsonText(record) << std::flush))
    throw Error(ErrorKind::file, file.string(), "cannot be written; check the folder's permissions and the disk");
}

std::string statusOf(const Json& record) {
  return record.is_object() && record.contains("status") && record["status"].is_string()
             ? record["status"].get<std::string>()
             : std::string();
}

std::string contentOf(const Console& console, const std::string& surface) {
  if (isShape(surface)) return "shape";
  std::error_code missing;
  if (!fs::is_regular_file(surface, missing)) return {};
  const std::string extension = lowerExtension(surface);
  if (extension == ".gltf" || extension == ".glb")
    return fmt::format("mesh {:016x}", fingerprint(importSurface(console, surface).mesh));
  std::ifstream file(surface, std::ios::binary);
  std::vector<char> piece(std::size_t{1} << 20);
  std::uint64_t hash = 0;
  while (file) {
    file.read(piece.data(), std::streamsize(piece.size()));
    hash = XXH3_64bits_withSeed(piece.data(), std::size_t(file.gcount()), hash);
  }
  return file.eof() ? fmt::format("bytes {:016x}", hash) : std::string();
}

Json madeFrom(const std::string& surface, const std::string& content, const Arguments& arguments,
              const fs::path& field) {
  const Json made = {{"program", versionText()},
                     {"mesh", surface},
                     {"content", content},
                     {"options", linesJson(decidingArguments(arguments))},
                     {"given", givenNames(arguments)},
                     {"compress", arguments.flag("compress")},
                     {"field", checksumOf(field)}};
  return Json::parse(jsonText(made));  // as a record of it is read: bytes that are not UTF-8 are replaced
}

}  // namespace hpsdf::app
