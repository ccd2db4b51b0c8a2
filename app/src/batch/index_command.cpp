#include "batch/index_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "batch/batch.h"
#include "batch/batch_list.h"
#include "batch/mesh_record.h"
#include "batch/set_page.h"
#include "files/output_folder.h"
#include "hpsdf/app/failed.h"
#include "hpsdf/detail/output_file.h"
#include "session/session.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPage = "index.html";
constexpr const char* kLines = "index.jsonl";
constexpr std::string_view kRecordEnding = ".json";

/// Returns true if a file is called as the record of a mesh is: a dash, the sixteen digits of a hash, and .json at the
/// end (`BatchMesh::name`).
bool isNameOfRecord(std::string_view file) {
  constexpr std::size_t kDigits = 16;
  if (!file.ends_with(kRecordEnding)) return false;
  file.remove_suffix(kRecordEnding.size());
  if (file.size() <= kDigits || file[file.size() - kDigits - 1] != '-') return false;
  return file.substr(file.size() - kDigits).find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

/// Returns the names of the regular files in a folder.
std::vector<std::string> filesIn(const fs::path& folder) {
  std::vector<std::string> files;
  try {
    for (const auto& entry : fs::directory_iterator(folder))
      if (entry.is_regular_file()) files.push_back(entry.path().filename());
  } catch (const fs::filesystem_error& error) {
    throw Error(ErrorKind::file, folder.string(),
                fmt::format("cannot be read ({}); name the folder of a batch", error.code().message()));
  }
  std::ranges::sort(files);
  return files;
}

/// Returns the meshes of which the folder holds a record, by their names. A mesh whose field has gone is missing.
std::map<std::string, SetMesh> meshesIn(const fs::path& folder) {
  const std::vector<std::string> files = filesIn(folder);
  std::map<std::string, SetMesh> meshes;
  for (const std::string& file : files) {
    if (!isNameOfRecord(file)) continue;
    const std::string name = file.substr(0, file.size() - kRecordEnding.size());
    Json record = readRecord(folder / file);
    if (!statusOf(record).empty()) meshes[name] = {std::move(record), name, {}};
  }
  for (const std::string& file : files)
    for (std::size_t dot = file.rfind('.'); dot != std::string::npos && dot > 0; dot = file.rfind('.', dot - 1))
      if (const auto mesh = meshes.find(file.substr(0, dot)); mesh != meshes.end()) {
        // Files with .part- in their names are being written, or a killed process has left them (output_file.h).
        if (file.find(".part-", dot) == std::string::npos) mesh->second.endings.push_back(file.substr(dot));
        break;  // the longest name that fits
      }
  for (auto& [name, mesh] : meshes)
    if (statusOf(mesh.record) == kBuilt && std::ranges::find(mesh.endings, ".hpsdf") == mesh.endings.end())
      mesh.record["status"] = kMissing;
  return meshes;
}

/// Returns the meshes of the list, those without a record with the status kMissing.
std::vector<SetMesh> meshesOfList(std::map<std::string, SetMesh> known, const std::vector<BatchMesh>& list) {
  std::vector<SetMesh> meshes;
  for (const BatchMesh& mesh : list) {
    if (const auto found = known.find(mesh.name); found != known.end())
      meshes.push_back(std::move(found->second));
    else
      meshes.push_back({{{"file", mesh.surface}, {"status", kMissing}}, mesh.name, {}});
  }
  return meshes;
}

std::string linesOf(const std::vector<SetMesh>& meshes) {
  std::string lines;
  for (const SetMesh& mesh : meshes) {
    Json line = mesh.record;
    line.erase(kMadeFrom);
    line.erase(kThen);
    lines += jsonLine(line);
  }
  return lines;
}

void runIndex(Session& session, const Arguments& arguments) {
  const fs::path folder = arguments.text("folder");
  std::map<std::string, SetMesh> known = meshesIn(folder);
  std::vector<SetMesh> meshes;
  if (arguments.has("batch"))
    meshes = meshesOfList(std::move(known), readBatchList(session.console(), arguments.text("batch")));
  else
    for (auto& [name, mesh] : known) meshes.push_back(std::move(mesh));
  if (meshes.empty()) throw Error(folder.string() + ": holds no field of a batch; name the folder of 'build --batch'");
  OutputFile::removeAllAbandoned(folder);
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
  if (const std::size_t unfinished = meshes.size() - counts[kBuilt]; unfinished > 0)
    throw Failed(fmt::format("{}: {} of {} meshes are not built; the page lists them", folder.string(), unfinished,
                             meshes.size()),
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

With --batch, the page holds the meshes of the list, and those for which the folder has no field are listed as missing. The
exit status is 3 if a mesh is missing, has failed, or is begun, that is, a process is at work on it or has died at it; it is
0 otherwise. Half-written files that killed processes have left in the folder are removed.)"),
      .examples = {"hpsdf index fields", "hpsdf index fields --batch list.txt"},
      .parameters = {{"folder", text("FOLDER").positional().required(), "Folder of the fields."},
                     {"batch", file("LIST"), "List of meshes, as of 'build --batch'; - is standard input."}},
      .action = runIndex,
  });
}

}  // namespace hpsdf::app
