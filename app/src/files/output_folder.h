#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/detail/output_file.h"

namespace hpsdf::app {

/// A folder for results. The constructor creates it with its parents where they do not exist. The destructor removes
/// the folders that it created and that are empty, unless `keep` was called; other folders and files are never removed.
class OutputFolder {
 public:
  /// Throws `Error` naming the folder where it cannot be created.
  explicit OutputFolder(const std::filesystem::path& folder);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  void keep() { created_.clear(); }

  /// Writes a file under a temporary name. `commit` gives all such files their names and keeps the folder. Without
  /// `commit` the files are removed, and older files of the same names stay. Both functions throw `Error` as
  /// `OutputFile` does.
  void write(const std::string& name, std::string_view bytes);
  void commit();

  const std::filesystem::path& path() const { return path_; }

  /// Throws `Error` where the folder holds files but no file `marker`, by which a folder of earlier results is
  /// recognized.
  void requireOwn(const std::string& marker) const;

  /// Writes an empty marker, so that a folder of incomplete results is recognized too, and removes the results of
  /// earlier runs, which are the files whose names `isResult` accepts. Call `requireOwn` first.
  void startAnew(const std::string& marker, const std::function<bool(const std::string&)>& isResult) const;

 private:
  void removeCreated();

  std::filesystem::path path_;
  std::vector<std::filesystem::path> created_;  // folders that the constructor created, innermost first
  std::vector<std::unique_ptr<OutputFile>> files_;
};

/// A new folder in the system's folder for temporary files. The destructor removes it with its contents.
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
