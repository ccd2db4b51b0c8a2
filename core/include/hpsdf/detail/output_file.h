#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string_view>

namespace hpsdf {

/// A file that appears whole or not at all. It is written under a temporary name in the same folder, and
/// `commit` renames it. Until `commit`, an older file of the same name stays unchanged. Without `commit`, the
/// destructor removes the temporary file.
///
/// A symbolic link is followed, also if the file to which it leads does not exist yet: that file is written, in its own
/// folder, and the link stays.
class OutputFile {
 public:
  /// Creates the temporary file. Throws `Error` (of the kind `file`) if the folder of `file` does not exist or cannot
  /// be written, if `file` exists and is not a regular file, or if symbolic links lead in a circle.
  explicit OutputFile(const std::filesystem::path& file);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends bytes to the file. Throws `Error` (of the kind `file`) if the disk is full or fails.
  void write(std::span<const std::byte> bytes);
  void write(std::string_view text);

  /// Forces everything written so far onto the disk. Throws `Error` as `write` does; a full disk is noticed now at the
  /// latest.
  void flush();

  /// Flushes the temporary file and gives it its final name. Throws `Error` as `write` does. Nothing can be
  /// written to the file afterwards.
  void commit();

  /// Removes the temporary files of all `OutputFile`s that are not committed. A signal handler that is about to
  /// end the process may call this function, because it makes async-signal-safe calls only.
  static void removeUnfinished() noexcept;

  /// Removes temporary files that earlier writers of `file` left in the folder of `file`: those of processes of this
  /// machine that no longer run, and those of other machines that nobody has changed for a day.
  static void removeAbandoned(const std::filesystem::path& file);
  /// Removes such temporary files of any file of a folder.
  static void removeAllAbandoned(const std::filesystem::path& folder);

 private:
  [[noreturn]] void fail();

  std::filesystem::path file_;
  std::filesystem::path temporary_;
  std::FILE* stream_ = nullptr;
};

/// Throws the `Error` that the constructor of `OutputFile` would throw for `file`. A caller thus learns before long
/// work that it could not write the file.
void checkWritable(const std::filesystem::path& file);

}  // namespace hpsdf
