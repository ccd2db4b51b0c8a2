#include "files/text_file.h"

#include <fmt/format.h>

#include <fstream>
#include <istream>
#include <limits>
#include <sstream>
#include <vector>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"

namespace hpsdf::app {

namespace {

std::ifstream openFile(const std::string& file) {
  std::error_code ignored;
  const auto status = std::filesystem::status(file, ignored);
  if (std::filesystem::is_directory(status)) throw Error(file + ": is a folder; give a file");
  if (std::filesystem::is_character_file(status) || std::filesystem::is_block_file(status))
    throw Error(file + ": is a device; give a file");
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    throw Error(file + (std::filesystem::exists(status) ? ": cannot be read; check its permissions"
                                                        : ": no such file; check the name"));
  return stream;
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

std::string readText(std::istream& in, const std::string& name) { return readAll(in, name, kMostTextBytes); }

std::string readTextFile(const std::string& file) {
  std::ifstream stream = openFile(file);
  return readText(stream, file);
}

std::string readWholeFile(const std::string& file) {
  std::ifstream stream = openFile(file);
  return readAll(stream, file, std::numeric_limits<std::size_t>::max());
}

void writeTextFile(const std::filesystem::path& file, std::string_view text) {
  OutputFile out(file);
  out.write(text);
  out.commit();
}

}  // namespace hpsdf::app
