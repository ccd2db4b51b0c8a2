#include "window/recent_files.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "files/text_file.h"
#include "hpsdf/error.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMost = 10;

/// Returns the file that holds the list, or "" if the environment names no folder for it.
fs::path listFile() {
  const auto variable = [](const char* name) {
    const char* const value = std::getenv(name);
    return fs::path(value == nullptr ? "" : value);
  };
  if (const fs::path state = variable("XDG_STATE_HOME"); state.is_absolute()) return state / "hpsdf" / "recent";
  const fs::path home = variable("HOME");
  return home.is_absolute() ? home / ".local" / "state" / "hpsdf" / "recent" : fs::path();
}

/// Returns the absolute names in the list. A list that is missing or damaged has none.
std::vector<std::string> remembered() {
  std::vector<std::string> files;
  std::ifstream list(listFile());
  for (std::string line; files.size() < kMost && std::getline(list, line);)
    if (line.starts_with('/')) files.push_back(line);
  return files;
}

bool isFile(const fs::path& file) {
  std::error_code unknown;
  return fs::is_regular_file(file, unknown);
}

/// Returns the name of the file relative to the current folder if it lies within it.
std::string shortName(const std::string& file) {
  std::error_code unknown;
  const fs::path folder = fs::current_path(unknown);
  const fs::path relative = unknown ? fs::path() : fs::path(file).lexically_relative(folder);
  return relative.empty() || relative.string().starts_with("..") ? file : relative.string();
}

}  // namespace

std::vector<std::string> recentFiles() {
  std::vector<std::string> files;
  for (const std::string& file : remembered())
    if (isFile(file)) files.push_back(shortName(file));
  return files;
}

void rememberFile(const std::string& file) {
  const fs::path list = listFile();
  std::error_code failed;
  const std::string name = fs::absolute(file, failed).lexically_normal().string();
  if (list.empty() || failed || !isFile(file) || name.find('\n') != std::string::npos) return;
  std::vector<std::string> files = remembered();
  std::erase(files, name);
  files.insert(files.begin(), name);
  files.resize(std::min(files.size(), kMost));
  std::string text;
  for (const std::string& each : files) text += each + "\n";
  fs::create_directories(list.parent_path(), failed);
  try {
    writeTextFile(list.string(), text);
  } catch (const Error&) {  // a list that cannot be written is missed by nobody
  }
}

}  // namespace hpsdf::app
