#include "files/text_file.h"

#include <fmt/format.h>

#include <istream>
#include <limits>
#include <vector>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"

namespace hpsdf::app {

namespace {

/// Opens a file for reading. Throws `Error` for a device, because reading a device might never end.
std::ifstream openFiniteFile(const std::string& file) {
  std::error_code ignored;
  const auto status = std::filesystem::status(file, ignored);
  if (std::filesystem::is_character_file(status) || std::filesystem::is_block_file(status))
    throw Error(file + ": is a device; give a file");
  return openFile(file);
}

std::string readAll(std::istream& in, const std::string& name, std::size_t mostBytes) {
  std::string text;
  std::vector<char> piece(std::size_t{1} << 16);
  while (in) {
    in.read(piece.data(), std::streamsize(piece.size()));
    text.append(piece.data(), std::size_t(in.gcount()));
    if (text.size() > mostBytes)
      throw Error(fmt::format("{}: is longer than {} bytes; check that it is the right one", name, mostBytes));
  }
  if (in.bad()) throw Error(name + ": cannot be read to its end; check where it lies");
  return text;
}

}  // namespace

std::ifstream openFile(const std::filesystem::path& file, const std::string& wanted) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) throw Error(file.string() + ": is a folder; give " + wanted);
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    throw Error(file.string() + (std::filesystem::exists(file, ignored) ? ": cannot be read; check its permissions"
                                                                        : ": no such file; check the name"));
  return stream;
}

std::string readText(std::istream& in, const std::string& name) { return readAll(in, name, kMostTextBytes); }

std::string readTextFile(const std::string& file) {
  std::ifstream stream = openFiniteFile(file);
  return readText(stream, file);
}

std::string readWholeFile(const std::string& file) {
  std::ifstream stream = openFiniteFile(file);
  return readAll(stream, file, std::numeric_limits<std::size_t>::max());
}

void writeTextFile(const std::filesystem::path& file, std::string_view text) {
  OutputFile out(file);
  out.write(text);
  out.commit();
}

}  // namespace hpsdf::app
