// Compares all #include lines with the tables of docs/design.md: which top-level folder and which subfolder may include
// which. Neither folders nor units (a header with its .cpp) may include each other in a cycle.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace include_direction_test {

namespace fs = std::filesystem;
using Lines = std::vector<std::string>;

constexpr std::array<std::string_view, 9> kRooms = {"core", "render", "physics", "openvdb", "mpi",
                                                    "web",  "app",    "c",       "python"};
constexpr std::size_t kMostFilesInFolder = 20;
constexpr std::size_t kMostFilesInAppItself = 4;

bool isRoom(std::string_view name) { return std::find(kRooms.begin(), kRooms.end(), name) != kRooms.end(); }

/// Returns true if a file in the top-level folder `from` may include a file in the top-level folder `to`.
bool mayInclude(std::string_view from, std::string_view to) {
  if (from == "web") return to == from;
  if (from == "python") return to == from || to == "core" || to == "render" || to == "app";
  return from == to || to == "core" || (from == "app" && to != "c" && to != "python");
}

struct Include {
  std::string path;
  bool angled;
};

std::optional<Include> parseInclude(const std::string& line) {
  static const std::regex pattern(R"(^\s*#\s*include\s*(?:"([^"]+)\"|<([^>]+)>).*)");
  std::smatch match;
  if (!std::regex_match(line, match, pattern)) return std::nullopt;
  return match[1].matched ? Include{match[1], false} : Include{match[2], true};
}

std::vector<std::string> parts(const fs::path& path) {
  std::vector<std::string> result;
  for (const fs::path& part : path) result.push_back(part.string());
  return result;
}

/// Returns the included file's path in the repository: "hpsdf/…" is a public header, as is "hpsdf.h" of the room c,
/// "../…" is relative to `file`, "core/…" and the like start at the root, and any other path is a private header in the
/// top-level folder of `file`.
fs::path target(const fs::path& file, const std::string& include) {
  const auto names = parts(include);
  if (include == "hpsdf.h") return "c/include/hpsdf.h";
  if (names[0] == "hpsdf") {
    const bool isOfAnotherRoom = names.size() > 2 && isRoom(names[1]);
    return fs::path(isOfAnotherRoom ? names[1] : "core") / "include" / include;
  }
  if (names[0] == "..") return (file.parent_path() / include).lexically_normal();
  if (isRoom(names[0])) return include;
  return *file.begin() / fs::path("src") / include;
}

bool isStandardOrEigen(const std::string& include) {
  if (include == "stddef.h" || include == "stdint.h") return true;  // in the header for C
  const auto isInStandardName = [](char c) {
    return std::islower(static_cast<unsigned char>(c)) || std::isdigit(c) || c == '_';
  };
  return include.starts_with("Eigen/") || std::all_of(include.begin(), include.end(), isInStandardName);
}

bool isGraphics(const std::string& include) {
  constexpr std::array<std::string_view, 8> kFolders = {"GL/",  "GLES2/", "GLES3/", "EGL/",
                                                        "KHR/", "epoxy/", "GLFW/",  "imgui"};
  return std::any_of(kFolders.begin(), kFolders.end(),
                     [&](std::string_view name) { return include.starts_with(name); });
}

/// Returns why `file` (a path in the repository) must not contain this #include; empty if it may.
std::string fault(const fs::path& file, const Include& include) {
  const std::string room = *parts(file).begin();
  const bool isPublic = parts(file).at(1) == "include";
  if (!include.angled || include.path.starts_with("hpsdf")) {
    const auto names = parts(target(file, include.path));
    if (!isRoom(names[0])) return "lies in no room";
    if (!mayInclude(room, names[0])) return room + " must not know " + names[0];
    if (room != names[0] && names.at(1) == "src") return "a private header of " + names[0];
    if (isPublic && names.at(1) == "src") return "a private header in a public one";
    return {};
  }
  if (room == "core" && isGraphics(include.path)) return "core has no graphics";
  if (isPublic && !isStandardOrEigen(include.path)) return "public headers take std and Eigen only";
  return {};
}

/// Calls `visit(line number, include)` for each #include line of a text.
void forEachInclude(const std::string& text, const std::function<void(int, const Include&)>& visit) {
  std::istringstream stream(text);
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number)
    if (const auto include = parseInclude(line)) visit(number, *include);
}

/// Returns the forbidden #include lines of a file's text as "path:line: include: fault".
Lines faults(const fs::path& file, const std::string& text) {
  Lines result;
  forEachInclude(text, [&](int number, const Include& include) {
    if (const std::string found = fault(file, include); !found.empty())
      result.push_back(file.string() + ":" + std::to_string(number) + ": " + include.path + ": " + found);
  });
  return result;
}

std::vector<fs::path> sourceFiles(const fs::path& root) {
  std::vector<fs::path> result;
  for (const std::string_view room : kRooms) {
    if (!fs::exists(root / room)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / room)) {
      const fs::path extension = entry.path().extension();
      if (extension == ".h" || extension == ".cpp") result.push_back(fs::relative(entry.path(), root));
    }
  }
  return result;
}

std::string read(const fs::path& file) {
  std::ifstream stream(file);
  std::stringstream text;
  text << stream.rdbuf();
  EXPECT_TRUE(stream.good()) << file;
  return text.str();
}

/// Maps the paths of source files, relative to the repository, to their texts.
using Sources = std::map<fs::path, std::string>;

Sources readSources(const fs::path& root) {
  Sources sources;
  for (const fs::path& file : sourceFiles(root)) sources[file] = read(root / file);
  return sources;
}

/// A row of the tables of folders in docs/design.md.
struct Folder {
  std::set<std::string> mayInclude;  ///< folders with the same top-level folder that this folder may include
  std::set<std::string> headers;     ///< public headers that belong to this folder and have no .cpp
};
using Folders = std::map<std::string, Folder>;

/// Returns the words in backticks in a cell of a Markdown table.
std::set<std::string> quotedWords(const std::string& cell) {
  static const std::regex word("`([^`]+)`");
  std::set<std::string> words;
  for (std::sregex_iterator at(cell.begin(), cell.end(), word), end; at != end; ++at) words.insert((*at)[1]);
  return words;
}

/// Reads table rows of the form "| `core/src/mesh` | contents | `util`, … | `header.h`, … |".
Folders parseFolders(const std::string& design) {
  static const std::regex row(
      R"(^\| `((?:core|render|physics|openvdb|mpi|web|app|c|python)/[^`]+)` \|([^|]*)\|([^|]*)\|([^|]*)\|$)");
  Folders folders;
  std::istringstream stream(design);
  std::string line;
  while (std::getline(stream, line)) {
    std::smatch match;
    if (std::regex_match(line, match, row)) folders[match[1]] = {quotedWords(match[3]), quotedWords(match[4])};
  }
  return folders;
}

/// Maps files to units. A header and the .cpp of the same name form a unit, named after the .cpp without extension.
class Units {
 public:
  Units(const Sources& sources, const Folders& folders) : folders_(folders) {
    for (const auto& [file, text] : sources)
      if (file.extension() == ".cpp") implementations_[{*file.begin(), file.stem()}] = withoutExtension(file);
  }

  std::string unitOf(const fs::path& file) const {
    fs::path bare = withoutExtension(file);
    if (bare.filename().string().ends_with("-inl")) bare = bare.string().substr(0, bare.string().size() - 4);
    if (!isInInterface(file)) return bare.string();
    const auto found = implementations_.find({*file.begin(), bare.filename()});
    return (found == implementations_.end() ? bare : found->second).string();
  }

  /// Returns the folder of a file's unit; empty for a public header without a .cpp that no table lists.
  std::string folderOf(const fs::path& file) const {
    const fs::path unit = unitOf(file);
    if (!isInInterface(unit)) return unit.parent_path().string();
    for (const auto& [name, folder] : folders_)
      if (name.starts_with((*file.begin()).string() + "/") && folder.headers.contains(file.filename().string()))
        return name;
    return {};
  }

 private:
  static fs::path withoutExtension(fs::path file) { return file.replace_extension(); }
  static bool isInInterface(const fs::path& file) { return file.string().find("/include/") != std::string::npos; }

  const Folders& folders_;
  std::map<std::pair<fs::path, fs::path>, fs::path> implementations_;
};

using Graph = std::map<std::string, std::set<std::string>>;

/// Finds a cycle of the graph by depth-first search and returns it as "a -> b -> a"; empty if there is none.
std::string findCircle(const Graph& graph) {
  std::set<std::string> finished;
  Lines path;
  std::string circle;
  const std::function<bool(const std::string&)> visit = [&](const std::string& node) {
    if (finished.contains(node)) return false;
    if (const auto open = std::find(path.begin(), path.end(), node); open != path.end()) {
      for (auto at = open; at != path.end(); ++at) circle += *at + " -> ";
      circle += node;
      return true;
    }
    path.push_back(node);
    if (const auto edges = graph.find(node); edges != graph.end())
      for (const std::string& next : edges->second)
        if (visit(next)) return true;
    path.pop_back();
    finished.insert(node);
    return false;
  };
  for (const auto& [node, edges] : graph)
    if (visit(node)) break;
  return circle;
}

/// The umbrella header hpsdf.h includes all public headers, and no other file of the library includes it.
bool isUmbrella(const fs::path& file) { return file == "core/include/hpsdf/hpsdf.h"; }

/// Returns the violations of the design's tables: forbidden includes, cycles, and files in no listed folder.
Lines structureFaults(const Sources& sources, const Folders& folders) {
  Lines result;
  const Units units(sources, folders);
  Graph unitGraph, folderGraph;
  for (const auto& [file, text] : sources) {
    if (isUmbrella(file)) continue;
    const std::string folder = units.folderOf(file);
    if (!folders.contains(folder)) result.push_back(file.string() + ": belongs to no folder of docs/design.md");
    forEachInclude(text, [&](int number, const Include& include) {
      const fs::path included = target(file, include.path);
      if (!sources.contains(included)) return;
      if (units.unitOf(included) != units.unitOf(file)) unitGraph[units.unitOf(file)].insert(units.unitOf(included));
      const std::string other = units.folderOf(included);
      if (other == folder || *included.begin() != *file.begin()) return;
      folderGraph[folder].insert(other);
      const auto known = folders.find(folder);
      if (known != folders.end() && !known->second.mayInclude.contains(other))
        result.push_back(file.string() + ":" + std::to_string(number) + ": " + folder + " must not know " + other);
    });
  }
  if (const std::string circle = findCircle(unitGraph); !circle.empty()) result.push_back("circle of units: " + circle);
  if (const std::string circle = findCircle(folderGraph); !circle.empty())
    result.push_back("circle of folders: " + circle);
  return result;
}

/// Returns the folders that have too many files for a reader to survey.
Lines crowdedFolders(const Sources& sources) {
  std::map<std::string, std::size_t> counts;
  for (const auto& [file, text] : sources) ++counts[file.parent_path().string()];
  Lines result;
  for (const auto& [folder, count] : counts)
    if (count > (folder == "app/src" ? kMostFilesInAppItself : kMostFilesInFolder))
      result.push_back(folder + ": " + std::to_string(count) + " files");
  return result;
}

/// Maps each folder to the names of its units.
using UnitsOfFolders = std::map<std::string, std::set<std::string>>;

/// Reads the Markdown lists below lines like "**core/src/mesh**", with items like "* `patches`: contents".
UnitsOfFolders parseUnits(const std::string& design) {
  static const std::regex heading(R"(^\*\*([^*]+)\*\*$)"), item(R"(^\* `([^`]+)`: .*)");
  UnitsOfFolders units;
  std::string folder, line;
  std::istringstream stream(design);
  while (std::getline(stream, line)) {
    std::smatch match;
    if (std::regex_match(line, match, heading))
      folder = match[1];
    else if (line.starts_with("#"))
      folder.clear();
    else if (!folder.empty() && std::regex_match(line, match, item))
      units[folder].insert(match[1]);
  }
  return units;
}

/// Returns the units that are missing in the lists, and the listed units that do not exist.
Lines listFaults(const Sources& sources, const Folders& folders, const UnitsOfFolders& listed) {
  const Units units(sources, folders);
  UnitsOfFolders found;
  for (const auto& [file, text] : sources)
    if (!isUmbrella(file)) found[units.folderOf(file)].insert(fs::path(units.unitOf(file)).filename());
  Lines result;
  const auto report = [&](const UnitsOfFolders& some, const UnitsOfFolders& others, const std::string& what) {
    for (const auto& [folder, names] : some)
      for (const std::string& name : names)
        if (!others.contains(folder) || !others.at(folder).contains(name)) result.push_back(folder + "/" + name + what);
  };
  report(found, listed, ": is not in the list of docs/design.md");
  report(listed, found, ": is listed in docs/design.md and does not exist");
  return result;
}

TEST(IncludeDirection, runsOneWayInEveryRoom) {
  const fs::path root = HPSDF_SOURCE_DIR;
  const Sources sources = readSources(root);
  std::size_t seen = 0;
  for (const auto& [file, text] : sources) {
    seen += text.find("#include") != std::string::npos ? 1 : 0;
    for (const std::string& line : faults(file, text)) ADD_FAILURE() << line;
  }
  EXPECT_GT(seen, 20u) << "of " << sources.size() << " files: the rooms were not found under " << root;
}

TEST(IncludeDirection, followsTheTablesOfTheDesign) {
  const fs::path root = HPSDF_SOURCE_DIR;
  const Folders folders = parseFolders(read(root / "docs/design.md"));
  EXPECT_GT(folders.size(), 20u) << "the tables of docs/design.md were not found";
  for (const auto& [name, folder] : folders) EXPECT_TRUE(fs::is_directory(root / name)) << name;
  for (const std::string& line : structureFaults(readSources(root), folders)) ADD_FAILURE() << line;
}

TEST(IncludeDirection, listsEveryUnitInTheDesign) {
  const fs::path root = HPSDF_SOURCE_DIR;
  const std::string design = read(root / "docs/design.md");
  for (const std::string& line : listFaults(readSources(root), parseFolders(design), parseUnits(design)))
    ADD_FAILURE() << line;
}

TEST(IncludeDirection, findsNoCrowdedFolder) {
  for (const std::string& line : crowdedFolders(readSources(HPSDF_SOURCE_DIR))) ADD_FAILURE() << line;
}

TEST(IncludeDirection, noticesACrowdedFolder) {
  Sources sources;
  for (std::size_t i = 0; i < kMostFilesInAppItself; ++i) sources["app/src/" + std::to_string(i) + ".h"];
  EXPECT_EQ(crowdedFolders(sources), Lines{});
  sources["app/src/one_more.h"];
  EXPECT_EQ(crowdedFolders(sources).size(), 1u);
}

constexpr const char* kSampleTables =
    "| folder | contents | may include | headers |\n"
    "|---|---|---|---|\n"
    "| `core/src/util` | vectors | – | `types.h` |\n"
    "| `core/src/mesh` | meshes | `core/src/util` | – |\n";

TEST(IncludeDirection, readsTheTables) {
  const Folders folders = parseFolders(kSampleTables);
  ASSERT_EQ(folders.size(), 2u);
  EXPECT_EQ(folders.at("core/src/util").headers, std::set<std::string>{"types.h"});
  EXPECT_EQ(folders.at("core/src/mesh").mayInclude, std::set<std::string>{"core/src/util"});
}

TEST(IncludeDirection, noticesUnitsThatAreNotListedOrDoNotExist) {
  const Sources sources = {{"core/include/hpsdf/types.h", ""}, {"core/src/mesh/parts.h", ""}};
  const UnitsOfFolders listed =
      parseUnits("**core/src/util**\n* `types`: vectors\n\n**core/src/mesh**\n* `faces`: lists\n");
  EXPECT_EQ(listFaults(sources, parseFolders(kSampleTables), listed),
            (Lines{"core/src/mesh/parts: is not in the list of docs/design.md",
                   "core/src/mesh/faces: is listed in docs/design.md and does not exist"}));
}

TEST(IncludeDirection, acceptsASoundStructure) {
  const Sources sources = {{"core/include/hpsdf/types.h", "#include <Eigen/Core>\n"},
                           {"core/include/hpsdf/mesh.h", "#include \"hpsdf/types.h\"\n"},
                           {"core/src/mesh/mesh.cpp", "#include \"hpsdf/mesh.h\"\n#include \"mesh/parts.h\"\n"},
                           {"core/src/mesh/parts.h", "#include \"hpsdf/mesh.h\"\n"}};
  Sources sound = sources;
  sound["core/src/mesh/mesh.cpp"] = "#include \"hpsdf/mesh.h\"\n";
  EXPECT_EQ(structureFaults(sound, parseFolders(kSampleTables)), Lines{});
  // mesh.cpp and mesh.h form one unit; together with parts.h it forms a cycle.
  EXPECT_EQ(structureFaults(sources, parseFolders(kSampleTables)),
            Lines{"circle of units: core/src/mesh/mesh -> core/src/mesh/parts -> core/src/mesh/mesh"});
}

TEST(IncludeDirection, noticesFoldersThatKnowEachOther) {
  const Sources sources = {{"core/src/util/vector.h", "#include \"mesh/mesh.h\"\n"},
                           {"core/src/mesh/mesh.h", ""},
                           {"core/src/mesh/parts.h", "#include \"util/vector.h\"\n"}};
  EXPECT_EQ(structureFaults(sources, parseFolders(kSampleTables)),
            (Lines{"core/src/util/vector.h:1: core/src/util must not know core/src/mesh",
                   "circle of folders: core/src/mesh -> core/src/util -> core/src/mesh"}));
}

TEST(IncludeDirection, noticesAFolderThatNoTableHas) {
  EXPECT_EQ(structureFaults({{"core/src/other/x.h", ""}}, parseFolders(kSampleTables)),
            Lines{"core/src/other/x.h: belongs to no folder of docs/design.md"});
}

struct Sample {
  const char* file;
  const char* text;
};

TEST(IncludeDirection, acceptsIncludesInTheRightDirection) {
  const Sample samples[] = {
      {"core/src/field/build/build.cpp",
       "#include \"hpsdf/build.h\"\n#include \"basis/legendre.h\"\n#include <tbb/task_group.h>"},
      {"core/include/hpsdf/field.h", "#include <array>\n#include <Eigen/Core>\n#include \"hpsdf/types.h\""},
      {"render/src/gl/context.cpp",
       "#include <epoxy/egl.h>\n#include <hpsdf/field.h>\n#include \"hpsdf/render/view.h\""},
      {"render/src/cpu/cpu_renderer.cpp", "#include \"../picture/colormap.h\""},
      {"physics/src/contacts.cpp", "#include \"hpsdf/physics/contacts.h\"\n#include \"hpsdf/field.h\""},
      {"app/src/main.cpp",
       "#include <CLI/CLI.hpp>\n#include \"hpsdf/render/picture.h\"\n#include \"hpsdf/physics/contacts.h\""},
      {"c/src/build.cpp", "#include \"hpsdf.h\"\n#include \"hpsdf/build.h\"\n#include \"call.h\""},
      {"c/include/hpsdf.h", "#include <stdint.h>"},
      {"core/src/mesh/shapes.cpp", "// not an include: \"hpsdf/render/view.h\"\nint include = 0;"},
  };
  for (const Sample& sample : samples)
    EXPECT_EQ(faults(sample.file, sample.text), Lines{}) << sample.file << "\n" << sample.text;
}

TEST(IncludeDirection, refusesIncludesInTheWrongDirection) {
  const Sample samples[] = {
      {"core/src/field/build/build.cpp", "#include \"hpsdf/render/view.h\""},
      {"core/src/field/build/build.cpp", "#include <hpsdf/render/view.h>"},
      {"core/src/field/build/build.cpp", "  #  include \"../../../../render/src/gl/context.h\"  // why not"},
      {"core/src/field/build/build.cpp", "#include \"app/src/language/registry.h\""},
      {"core/src/field/build/build.cpp", "#include \"hpsdf/physics/contacts.h\""},
      {"core/src/field/build/build.cpp", "#include <GL/gl.h>"},
      {"render/src/gl/context.cpp", "#include \"../../../app/src/language/registry.h\""},
      {"app/src/main.cpp", "#include <hpsdf.h>"},
      {"core/src/field/build/build.cpp", "#include \"hpsdf.h\""},
      {"c/src/build.cpp", "#include \"hpsdf/render/view.h\""},
      {"render/src/gl/context.cpp", "#include \"hpsdf/physics/contacts.h\""},
      {"physics/src/contacts.cpp", "#include \"hpsdf/render/view.h\""},
      {"physics/src/contacts.cpp", "#include \"app/src/language/registry.h\""},
  };
  for (const Sample& sample : samples)
    EXPECT_EQ(faults(sample.file, sample.text).size(), 1u) << sample.file << "\n" << sample.text;
}

TEST(IncludeDirection, refusesForeignHeadersInPublicOnes) {
  const Sample samples[] = {
      {"core/include/hpsdf/mesh_import.h", "#include <assimp/scene.h>"},
      {"core/include/hpsdf/triangle_mesh.h", "#include <xxhash.h>"},
      {"core/include/hpsdf/field.h", "#include \"field/evaluate.h\""},
      {"render/include/hpsdf/render/renderer.h", "#include <EGL/egl.h>"},
      {"render/include/hpsdf/render/renderer.h", "#include <GL/gl.h>"},
      {"render/include/hpsdf/render/renderer.h", "#include <epoxy/gl.h>"},
      {"render/include/hpsdf/render/image.h", "#include <stb_image.h>"},
      {"physics/include/hpsdf/physics/contacts.h", "#include <tbb/parallel_for.h>"},
      {"physics/include/hpsdf/physics/contacts.h", "#include \"rigid_transform.h\""},
  };
  for (const Sample& sample : samples)
    EXPECT_EQ(faults(sample.file, sample.text).size(), 1u) << sample.file << "\n" << sample.text;
}

TEST(IncludeDirection, refusesPrivateHeadersOfAnotherRoom) {
  EXPECT_EQ(faults("render/src/gl/upload.cpp", "#include \"../../../core/src/field/query/evaluate.h\"").size(), 1u);
  EXPECT_EQ(faults("app/src/main.cpp", "#include \"render/src/gl/context.h\"").size(), 1u);
  EXPECT_EQ(faults("physics/src/contacts.cpp", "#include \"../../core/src/threads.h\"").size(), 1u);
}

TEST(IncludeDirection, namesFileLineAndInclude) {
  const auto found = faults("core/src/field/build/build.cpp", "#include <array>\n\n#include \"hpsdf/render/view.h\"\n");
  EXPECT_EQ(found, Lines{"core/src/field/build/build.cpp:3: hpsdf/render/view.h: core must not know render"});
}

}  // namespace include_direction_test
