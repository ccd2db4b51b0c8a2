#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace hpsdf::detail {

/// A file whose bytes are mapped into memory, read-only. The operating system reads pages of it when they are touched,
/// and can drop them at any time.
class MappedFile {
 public:
  /// Throws `Error` (of the kind `file`) for a file that is missing or not a regular file, or that cannot be mapped.
  explicit MappedFile(const std::filesystem::path& file);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::span<const std::byte> bytes() const { return bytes_; }

  /// Tells the operating system that parts of the file will be read in any order, so that it reads no further pages
  /// than those that are touched or announced by `readSoon`.
  void readAnywhere() const;
  /// Tells the operating system to begin reading the pages that hold these bytes, which must lie in the file.
  void readSoon(std::size_t first, std::size_t size) const;

 private:
  std::span<const std::byte> bytes_;
};

}  // namespace hpsdf::detail
