#pragma once
// What the fuzz targets share. A target is one file with one `LLVMFuzzerTestOneInput`, which hands any bytes to one
// reader of ours: what that refuses is an `Error` of one line, what it takes has to hold what the target says.
// Everything else that leaves a target ends the program: any other exception, a broken promise, what the sanitizers
// find.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

extern "C" {
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
/// Of the fuzzing engine, for the mutators of targets: changes the bytes and returns how many there are then.
std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t maxSize);
}

namespace hpsdf::fuzz {

inline std::string_view textOf(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Ends the program, with a line that says what does not hold, where it does not.
void require(bool holds, std::string_view what);

/// Whether `read` goes through; what it refuses has to be an `Error` of one line.
bool reads(const std::function<void()>& read);

/// A file of that name, with these bytes, in a folder of the process's own: in memory where TMPDIR is.
std::filesystem::path fileOf(std::string_view name, std::string_view bytes);
std::string bytesOf(const std::filesystem::path& file);

/// Sets the last 8 bytes to the checksum of those before, as files with one have it.
void mendChecksum(std::uint8_t* data, std::size_t size);

}  // namespace hpsdf::fuzz
