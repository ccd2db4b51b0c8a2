#include "batch/index_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "batch/batch_list.h"
#include "batch/mesh_record.h"
#include "batch/set_page.h"
#include "files/output_folder.h"
#include "files/text_file.h"
#include "hpsdf/app/failed.h"
#include "session/session.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPage = "index.html";
constexpr const char* kLines = "index.jsonl";
constexpr std::string_view kRecordEnding = ".json";

/// Returns the length of the name of a mesh's files (`BatchMesh::name`) with which the name of a file begins: up to the
/// first dot behind a dash and the sixteen digits of a hash. Returns 0 for other files.
std::size_t lengthOfName(std::string_view file) {
  constexpr std::size_t kDigits = 16;
  for (std::size_t dash = file.find('-'); dash != std::string_view::npos; dash = file.find('-', dash + 1)) {
    const std::size_t end = dash + 1 + kDigits;
    const std::string_view digits = file.substr(dash + 1, kDigits);
    if (end < file.size() && file[end] == '.' && digits.find_first_not_of("0123456789abcdef") == std::string_view::npos)
      return end;
  }
  return 0;
}

/// Returns the endings of the files in a folder, by the names before the endings.
std::map<std::string, std::vector<std::string>> endingsIn(const fs::path& folder) {
  std::map<std::string, std::vector<std::string>> endings;
  try {
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string file = entry.path().filename();
      const std::size_t length = lengthOfName(file);
      if (length > 0 && entry.is_regular_file()) endings[file.substr(0, length)].push_back(file.substr(length));
    }
  } catch (const fs::filesystem_error& error) {
    throw Error(ErrorKind::file, folder.string(),
                fmt::format("cannot be read ({}); name the folder of a batch", error.code().message()));
  }
  for (auto& [name, list] : endings) std::ranges::sort(list);
  return endings;
}

/// Returns the meshes of which the folder holds a record, in the order of their names.
std::vector<SetMesh> meshesIn(const fs::path& folder) {
  std::vector<SetMesh> meshes;
  for (auto& [name, endings] : endingsIn(folder)) {
    if (std::ranges::find(endings, kRecordEnding) == endings.end()) continue;
    Json record = readRecord(folder / (name + std::string(kRecordEnding)));
    if (!statusOf(record).empty()) meshes.push_back({std::move(record), name, std::move(endings)});
  }
  return meshes;
}

/// Adds the meshes of the list that have no record, with the status "missing".
void addMissing(std::vector<SetMesh>& meshes, const std::string& list) {
  std::set<std::string> known;
  for (const SetMesh& mesh : meshes) known.insert(mesh.name);
  for (const BatchMesh& mesh : parseBatchList(readTextFile(list)))
    if (!known.contains(mesh.name)) meshes.push_back({{{"file", mesh.surface}, {"status", "missing"}}, mesh.name, {}});
}

std::string linesOf(const std::vector<SetMesh>& meshes) {
  std::string lines;
  for (const SetMesh& mesh : meshes) {
    Json line = mesh.record;
    line.erase(kMadeFrom);
    line.erase(kThen);
    lines += line.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  }
  return lines;
}

void runIndex(Session& session, const Arguments& arguments) {
  const fs::path folder = arguments.text("folder");
  std::vector<SetMesh> meshes = meshesIn(folder);
  if (arguments.has("batch")) addMissing(meshes, arguments.text("batch"));
  if (meshes.empty()) throw Error(folder.string() + ": holds no field of a batch; name the folder of 'build --batch'");
  std::map<std::string, std::size_t> counts;
  for (const SetMesh& mesh : meshes) ++counts[statusOf(mesh.record)];

  OutputFolder output(folder);
  output.write(kLines, linesOf(meshes));
  output.write(kPage, setPage(fs::absolute(folder).lexically_normal().filename().string(), meshes));
  output.commit();

  const std::string page = (folder / kPage).string();
  if (session.wantsJson(arguments)) {
    printJson(session.console().out, {{"output", page}, {"meshes", meshes.size()}, {"status", counts}});
  } else {
    std::string text = fmt::format("{}: {} meshes", page, grouped(meshes.size()));
    for (const auto& [status, count] : counts) text += fmt::format(", {} {}", grouped(count), status);
    session.console().out << text << "\n";
  }
  if (const std::size_t unfinished = meshes.size() - counts["built"]; unfinished > 0)
    throw Failed(
        fmt::format("{}: {} of {} meshes have no field; the page says why", folder.string(), unfinished, meshes.size()),
        kExitPartlyFailed);
}

}  // namespace

void addIndexCommand(Registry& registry) {
  registry.add({
      .name = "index",
      .summary = "Make a page and a table of a folder of fields.",
      .help = paragraphs(R"(
FOLDER is the folder of fields that 'build --batch' has built. Two files are written into it. index.html is a page of all
meshes with their pictures, if the script of --then has drawn some, with figures, errors, a search and links to the files;
it needs no network. index.jsonl holds the same figures, one line of JSON for each mesh.

With --batch, meshes of the list for which the folder has no record are listed as missing. The exit status is 3 if a mesh
is missing, has failed, or ended the process that was at work on it (begun), and 0 otherwise.)"),
      .examples = {"hpsdf index fields", "hpsdf index fields --batch list.txt"},
      .parameters = {{"folder", text("FOLDER").positional().required(), "Folder of the fields."},
                     {"batch", file("LIST"), "List of meshes, as of 'build --batch', of which none may be missing."}},
      .action = runIndex,
  });
}

}  // namespace hpsdf::app
