#include "files/output_folder.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <cerrno>
#include <cstring>

#include "console/interrupt.h"
#include "hpsdf/error.h"

namespace hpsdf::app {

namespace fs = std::filesystem;

OutputFolder::OutputFolder(const fs::path& folder) : path_(folder) {
  for (fs::path part = fs::absolute(folder).lexically_normal(); !part.empty() && !fs::exists(part);
       part = part.parent_path())
    created_.push_back(part);
  std::error_code error;
  fs::create_directories(folder, error);
  if (fs::is_directory(folder)) return;
  removeCreated();
  throw Error(fmt::format("{}: cannot make this folder ({}); name another", folder.string(),
                          error ? error.message() : "a file of that name exists"));
}

OutputFolder::~OutputFolder() {
  files_.clear();  // removes the temporary files
  removeCreated();
}

void OutputFolder::write(const std::string& name, std::string_view bytes) {
  files_.push_back(std::make_unique<OutputFile>(path_ / name));
  files_.back()->write(bytes);
  files_.back()->flush();
}

void OutputFolder::commit() {
  const InterruptGuard guard;  // on Ctrl-C, all files are renamed or none
  for (const auto& file : files_) file->commit();
  files_.clear();
  keep();
}

/// Removes the empty folders among those that the constructor created.
void OutputFolder::removeCreated() {
  std::error_code ignored;
  for (const fs::path& part : created_) fs::remove(part, ignored);
}

void OutputFolder::requireOwn(const std::string& marker) const {
  if (!fs::is_empty(path_) && !fs::exists(path_ / marker))
    throw Error(fmt::format("{}: holds files that are not earlier results; name another folder", path_.string()));
}

void OutputFolder::startAnew(const std::string& marker, const std::function<bool(const std::string&)>& isResult) const {
  OutputFile file(path_ / marker);
  file.write("{}\n");
  file.commit();
  std::vector<fs::path> earlier;
  for (const auto& entry : fs::directory_iterator(path_))
    if (isResult(entry.path().filename().string())) earlier.push_back(entry.path());
  for (const fs::path& result : earlier) fs::remove_all(result);
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "hpsdf-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr)
    throw Error(fmt::format("{}: cannot make a temporary folder ({}); TMPDIR can name another folder", name,
                            std::strerror(errno)));
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace hpsdf::app
