#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/detail/output_file.h"

namespace hpsdf::app {

/// A folder for results. If the folder or its parents do not exist, the constructor creates them. Unless
/// `keep` was called, the destructor removes those folders that the constructor created and that are empty.
/// The destructor never removes other folders or files.
class OutputFolder {
 public:
  /// Creates the folder if it does not exist. Throws `Error` naming the folder if it cannot be created.
  explicit OutputFolder(const std::filesystem::path& folder);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  void keep() { created_.clear(); }

  /// Writes a file under a temporary name. `commit` renames all written files to their final names and keeps the
  /// folder. Without `commit` the written files are removed, and older files with the final names stay. `write` and
  /// `commit` throw `Error` as `OutputFile` does.
  void write(const std::string& name, std::string_view bytes);
  void commit();

  const std::filesystem::path& path() const { return path_; }

  /// Throws `Error` if the folder holds files but not the file `marker`. The marker shows that the files are results of
  /// an earlier run.
  void requireOwn(const std::string& marker) const;

  /// Writes the file `marker`, so that the folder is recognized even if the run ends without results. Then removes the
  /// results of earlier runs, which are the files whose names `isResult` accepts. Call `requireOwn` first.
  void startAnew(const std::string& marker, const std::function<bool(const std::string&)>& isResult) const;

 private:
  void removeCreated();

  std::filesystem::path path_;
  std::vector<std::filesystem::path> created_;  // folders that the constructor created, innermost first
  std::vector<std::unique_ptr<OutputFile>> files_;
};

/// A new folder inside the system's folder for temporary files. The destructor removes the new folder and its
/// contents.
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
