#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string_view>

namespace hpsdf {

/// A file that appears whole or not at all: written under a temporary name beside `file`, renamed by `commit`. Whatever
/// happens before leaves an older file as it was; without `commit` the destructor removes the temporary one.
class OutputFile {
 public:
  /// Throws `Error` when the folder does not exist or cannot be written, or when `file` names something that is not a
  /// regular file.
  explicit OutputFile(const std::filesystem::path& file);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends; throws `Error` naming the file when the disk is full or failing.
  void write(std::span<const std::byte> bytes);
  void write(std::string_view text);

  /// Takes all that was written to the disk: what fails for want of space fails here at the latest. Throws as `write`.
  void flush();

  /// Flushes and renames; throws `Error` as `write` does. Nothing can be written afterwards.
  void commit();

  /// Removes the temporary files of all that are not yet committed: for a signal handler that is about to end the
  /// process. Does only what a signal handler may do.
  static void removeUnfinished() noexcept;

  /// Whose temporary files beside a file are abandoned.
  enum class Writers {
    killed,  ///< processes of this machine that are no more
    others,  ///< all but this process: for who knows that nobody else is writing the file now
  };

  /// Removes the temporary files that such writers left beside `file` when they wrote it.
  static void removeAbandoned(const std::filesystem::path& file, Writers writers = Writers::killed);

 private:
  [[noreturn]] void fail();

  std::filesystem::path file_;
  std::filesystem::path temporary_;
  std::FILE* stream_ = nullptr;
};

/// Throws the `Error` that writing `file` would end with, as far as it can be told beforehand: before long work.
void checkWritable(const std::filesystem::path& file);

}  // namespace hpsdf
