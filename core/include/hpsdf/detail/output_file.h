#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string_view>

namespace hpsdf {

/// A file that appears whole or not at all: it is written under a temporary name in the same folder, and `commit`
/// renames it. An older file of that name stays as it was until then; without `commit` the destructor removes the
/// temporary file.
class OutputFile {
 public:
  /// Throws `Error` (file) when the folder does not exist or cannot be written, or when `file` names something that is
  /// not a regular file.
  explicit OutputFile(const std::filesystem::path& file);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends to the file. Throws `Error` (file) when the disk is full or fails.
  void write(std::span<const std::byte> bytes);
  void write(std::string_view text);

  /// Forces everything written so far onto the disk, so that a lack of space shows here at the latest. Throws as
  /// `write` does.
  void flush();

  /// Flushes and renames; throws `Error` as `write` does. Nothing can be written afterwards.
  void commit();

  /// Removes the temporary files of all `OutputFile`s that are not committed. A signal handler that is about to end the
  /// process may call this: it makes async-signal-safe calls only.
  static void removeUnfinished() noexcept;

  /// The processes whose temporary files `removeAbandoned` removes.
  enum class Writers {
    killed,  ///< processes of this machine that no longer run
    others,  ///< all processes but this one; for a caller that holds the lock on the file
  };

  /// Removes the temporary files of `file` that processes of the given kind left in its folder.
  static void removeAbandoned(const std::filesystem::path& file, Writers writers = Writers::killed);

 private:
  [[noreturn]] void fail();

  std::filesystem::path file_;
  std::filesystem::path temporary_;
  std::FILE* stream_ = nullptr;
};

/// Throws the `Error` that writing `file` would throw, as far as this is known beforehand. Call it before long work.
void checkWritable(const std::filesystem::path& file);

}  // namespace hpsdf
