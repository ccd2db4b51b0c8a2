#pragma once
// Functions that the fuzz targets share. A target is one file with one `LLVMFuzzerTestOneInput`, which passes any bytes
// to one reader of this project. The reader either throws an `Error` with a one-line message, or its result fulfils the
// target's requirements. Another exception, a violated requirement or a sanitizer's report ends the program.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

extern "C" {
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
/// Provided by the fuzzing engine for custom mutators: changes the bytes and returns their new number.
std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t maxSize);
}

namespace hpsdf::fuzz {

inline std::string_view textOf(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Ends the program with the message `what` unless `holds` is true.
void require(bool holds, std::string_view what);

/// Returns true if `read` succeeds, and false if it throws an `Error`, whose message must be one line.
bool reads(const std::function<void()>& read);

/// Writes `bytes` to a file with this name in a temporary folder of this process (under TMPDIR).
std::filesystem::path fileOf(std::string_view name, std::string_view bytes);
std::string bytesOf(const std::filesystem::path& file);

}  // namespace hpsdf::fuzz
