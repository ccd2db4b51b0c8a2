#pragma once
// Checksums of files whose bytes a test or a fuzz target changed.

#include <xxhash.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>

namespace hpsdf::support {

constexpr std::size_t kChecksumBytes = sizeof(XXH64_hash_t);

inline void putChecksum(std::span<const char> of, char* to) {
  const XXH64_hash_t checksum = XXH3_64bits(of.data(), of.size());
  std::memcpy(to, &checksum, sizeof checksum);
}

/// Sets the last 8 bytes to the checksum of all bytes before, as in files that end with a checksum.
inline void mendChecksum(std::span<char> bytes) {
  if (bytes.size() < kChecksumBytes) return;
  putChecksum(bytes.first(bytes.size() - kChecksumBytes), bytes.data() + bytes.size() - kChecksumBytes);
}

/// Sets the checksums at the end of a field file of version 12: of each block of 65,536 bytes, and of these checksums.
inline void mendBlockChecksums(std::span<char> bytes) {
  constexpr std::size_t kBlock = 65536, kBoth = kBlock + kChecksumBytes;
  if (bytes.size() < 2 * kChecksumBytes) return;
  const std::size_t blocks = (bytes.size() - kChecksumBytes + kBoth - 1) / kBoth;
  if (bytes.size() <= (blocks + 1) * kChecksumBytes) return;
  const std::size_t content = bytes.size() - (blocks + 1) * kChecksumBytes;
  for (std::size_t block = 0; block * kBlock < content; ++block)
    putChecksum(bytes.subspan(block * kBlock, std::min(kBlock, content - block * kBlock)),
                bytes.data() + content + block * kChecksumBytes);
  mendChecksum(bytes.subspan(content));
}

inline std::string withChecksum(std::string bytes) {
  mendChecksum(bytes);
  return bytes;
}

inline std::string withBlockChecksums(std::string bytes) {
  mendBlockChecksums(bytes);
  return bytes;
}

}  // namespace hpsdf::support
