#pragma once
// Reads and writes whole text files.

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace hpsdf::app {

/// Largest accepted text: scripts and lists of meshes are never this long.
constexpr std::size_t kMostTextBytes = std::size_t{1} << 26;

/// Opens a file of any kind but a folder. Throws `Error` where it cannot be read; the message asks for `wanted`.
std::ifstream openFile(const std::filesystem::path& file, const std::string& wanted = "a file");

/// Reads a stream to its end; `name` stands for it in messages. Throws `Error` where it is longer than `kMostTextBytes`
/// or cannot be read to its end.
std::string readText(std::istream& in, const std::string& name);

/// Reads a text file. Throws `Error` as `readText` does, and where the file is missing, a folder, or a device, which
/// might have no end.
std::string readTextFile(const std::string& file);

/// Reads a file of any length, such as a picture or a table. Throws `Error` as `readTextFile` does, except for the
/// length.
std::string readWholeFile(const std::string& file);

/// Writes a file under a temporary name and renames it. Throws `Error` naming the file, and leaves nothing behind then.
void writeTextFile(const std::filesystem::path& file, std::string_view text);

}  // namespace hpsdf::app
