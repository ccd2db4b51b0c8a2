#pragma once
// Reads and writes whole text files.

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace hpsdf::app {

/// The length in bytes of the largest text that is accepted. Scripts and lists of meshes are never this long.
constexpr std::size_t kMostTextBytes = std::size_t{1} << 26;

/// Opens a file for reading. Throws `Error` if the file cannot be read or is a folder. For a folder, the error message
/// asks for `wanted` instead.
std::ifstream openFile(const std::filesystem::path& file, const std::string& wanted = "a file");

/// Reads a stream to its end. Messages refer to the stream by `name`. Throws `Error` if the stream is longer
/// than `kMostTextBytes` or cannot be read to its end.
std::string readText(std::istream& in, const std::string& name);

/// Reads a text file. Throws `Error` as `readText` does. Also throws `Error` if the file is missing, is a
/// folder, or is a device, since reading a device might never end.
std::string readTextFile(const std::string& file);

/// Reads a file of any length, such as a picture or a table. Throws `Error` as `readTextFile` does, but
/// accepts files longer than `kMostTextBytes`.
std::string readWholeFile(const std::string& file);

/// Writes a file under a temporary name and then renames it to `file`. If the file cannot be written, throws `Error`
/// naming the file and leaves no temporary file behind.
void writeTextFile(const std::filesystem::path& file, std::string_view text);

}  // namespace hpsdf::app
