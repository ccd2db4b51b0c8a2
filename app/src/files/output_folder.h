#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/detail/output_file.h"

namespace hpsdf::app {

/// A folder that results are written to: made with those above it where they are not there yet. What was made is
/// removed again, unless something lies in it or `keep` was called. Nothing of others is ever removed.
class OutputFolder {
 public:
  /// Throws `Error` naming the folder when it cannot be made.
  explicit OutputFolder(const std::filesystem::path& folder);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  void keep() { created_.clear(); }

  /// Writes a file under a temporary name. `commit` gives all of them their own, and the folder is kept; without it
  /// none is left and earlier ones stay as they were. Throws `Error` as `OutputFile` does.
  void write(const std::string& name, std::string_view bytes);
  void commit();

  const std::filesystem::path& path() const { return path_; }

  /// For results that take a folder to themselves, known again by their file `marker`: throws `Error` where other
  /// things lie in it and no such file.
  void requireOwn(const std::string& marker) const;

  /// Writes an empty marker, so that what is broken off is known again too, and removes earlier results: what lies in
  /// the folder under a name that `isResult` knows. After `requireOwn`.
  void startAnew(const std::string& marker, const std::function<bool(const std::string&)>& isResult) const;

 private:
  void removeCreated();

  std::filesystem::path path_;
  std::vector<std::filesystem::path> created_;  // innermost first
  std::vector<std::unique_ptr<OutputFile>> files_;
};

/// A new folder under the system's own for such, removed with all that is in it.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace hpsdf::app
