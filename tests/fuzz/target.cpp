#include "target.h"

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>

#include "hpsdf/error.h"
#include "support/temporary_directory.h"

namespace hpsdf::fuzz {

void require(bool holds, std::string_view what) {
  if (holds) return;
  std::cerr << "does not hold: " << what << std::endl;
  std::abort();
}

bool reads(const std::function<void()>& read) {
  try {
    read();
    return true;
  } catch (const Error& error) {
    const std::string_view message = error.what();
    require(!message.empty() && message.find('\n') == std::string_view::npos, "a refusal is one line");
    return false;
  }
}

std::filesystem::path fileOf(std::string_view name, std::string_view bytes) {
  static const support::TemporaryDirectory folder;
  const std::filesystem::path file = folder / name;
  std::ofstream stream(file, std::ios::binary);
  stream << bytes;
  require(stream.flush().good(), "there is room for a small file");
  return file;
}

std::string bytesOf(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace hpsdf::fuzz
