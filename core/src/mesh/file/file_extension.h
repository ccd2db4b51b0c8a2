#pragma once

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string>

namespace hpsdf {

/// The file's extension in lower case, without the dot.
inline std::string extensionOf(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  if (!extension.empty()) extension.erase(0, 1);
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

}  // namespace hpsdf
