#pragma once
// The bytes of a mesh file, which pass through a window of fixed size.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "hpsdf/error.h"

namespace hpsdf::mesh {

/// Reads a file from its beginning to its end. A window of the file is in memory; it moves on as bytes are skipped.
/// Files whose names end in .gz are decompressed on the way.
class Input {
 public:
  /// The number of bytes that `ensure` can make available at once.
  static constexpr std::size_t kLongestPiece = std::size_t{1} << 16;

  /// Opens a file. Throws `Error` (of the kind `file`, with the subject `file`) if it is missing, a folder, not a
  /// regular file, empty, or not readable by this process. `progress` must outlive this object: it is told how much of
  /// the file has been read, and can cancel the reading at every new part of the window.
  Input(const std::filesystem::path& file, const Progress& progress);
  /// Takes the bytes of a file, which must outlive this object, and the name of the file for errors.
  Input(std::string_view bytes, const std::filesystem::path& file, const Progress& progress);
  ~Input();
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;

  const std::filesystem::path& file() const { return file_; }
  const Progress& progress() const { return progress_; }

  /// Returns the bytes of the window that have not been skipped. They stay valid until `ensure` is called.
  std::string_view rest() const { return {at_, end_}; }

  /// Skips the first bytes of `rest`.
  void skip(std::size_t count) { at_ += count; }

  /// Moves the window until `rest` has at least `count` bytes, at most `kLongestPiece`. Returns false if the file ends
  /// before; `rest` is then all that is left of it. Throws `Error` (of the kind `file`) if the file cannot be read on
  /// or if its compressed data are damaged. Throws `Cancelled` when `progress` says so.
  bool ensure(std::size_t count) { return std::size_t(end_ - at_) >= count || refill(count); }

  /// Returns the position of the first byte of `rest` in the file, decompressed.
  std::uint64_t offset() const { return windowEnd_ - std::uint64_t(end_ - at_); }

  /// Returns the number of bytes from the first byte of `rest` to the file's end or, for a compressed file, the
  /// greatest number that these may be. Sizes that a file promises are checked against it.
  std::uint64_t mostLeft() const;

  /// Returns the share of the file that has been read, 0 to 1.
  double share() const;

  /// Throws `Error` (of the kind `file`) that names the file, with the problem.
  [[noreturn]] void refuse(const std::string& problem) const;

 private:
  std::size_t readPart(char* bytes, std::size_t count);
  bool refill(std::size_t count);

  struct Source;
  std::filesystem::path file_;
  const Progress& progress_;
  std::unique_ptr<Source> source_;  ///< null if all bytes are in memory
  std::unique_ptr<char[]> window_;
  const char* at_ = nullptr;
  const char* end_ = nullptr;
  std::uint64_t windowEnd_ = 0;  ///< position of `end_` in the file, decompressed
};

}  // namespace hpsdf::mesh
