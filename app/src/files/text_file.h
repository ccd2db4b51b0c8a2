#pragma once
// Text files, read whole and written whole.

#include <cstddef>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <string_view>

namespace hpsdf::app {

/// Text that a person writes by hand or by a short script, a script of ours or a list, is never as long as this.
constexpr std::size_t kMostTextBytes = std::size_t{1} << 26;

/// All of a text that is called `name` in messages. Throws `Error` where it is longer than `kMostTextBytes`, or cannot
/// be read to its end.
std::string readText(std::istream& in, const std::string& name);

/// All of a text file. Throws `Error` as `readText`, and for a file that is missing, a folder, or a device, which may
/// have no end.
std::string readTextFile(const std::string& file);

/// All of a file of any length, such as a picture or a table. Throws `Error` as `readTextFile` otherwise.
std::string readWholeFile(const std::string& file);

/// The last line that is not empty; "" where there is none.
std::string lastLine(const std::string& text);

/// Writes a whole file under a temporary name first. Throws `Error` naming it; then nothing of it is left behind.
void writeTextFile(const std::filesystem::path& file, std::string_view text);

}  // namespace hpsdf::app
