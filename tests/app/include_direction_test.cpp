// Reads the #include lines of every room and fails on one that runs against core → render → app, core → physics → app.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <optional>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace {

namespace fs = std::filesystem;
using Lines = std::vector<std::string>;

constexpr std::array<std::string_view, 4> kRooms = {"core", "render", "physics", "app"};

bool isRoom(std::string_view name) { return std::find(kRooms.begin(), kRooms.end(), name) != kRooms.end(); }

/// Whether a file of room `from` may include one of room `to`.
bool mayInclude(std::string_view from, std::string_view to) { return from == to || to == "core" || from == "app"; }

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

/// The file that an include of ours means, relative to the repository: "hpsdf/…" are public headers, "../…" is relative
/// to the file itself, ROOM/… starts at the root, and all else is a private header of the file's own room.
fs::path target(const fs::path& file, const std::string& include) {
  const auto names = parts(include);
  if (names[0] == "hpsdf") {
    const bool ofOtherRoom = names.size() > 2 && isRoom(names[1]);
    return fs::path(ofOtherRoom ? names[1] : "core") / "include" / include;
  }
  if (names[0] == "..") return (file.parent_path() / include).lexically_normal();
  if (isRoom(names[0])) return include;
  return *file.begin() / fs::path("src") / include;
}

bool isStandardOrEigen(const std::string& include) {
  const auto isPlain = [](char c) {
    return std::islower(static_cast<unsigned char>(c)) || std::isdigit(c) || c == '_';
  };
  return include.starts_with("Eigen/") || std::all_of(include.begin(), include.end(), isPlain);
}

bool isGraphics(const std::string& include) {
  constexpr std::array<std::string_view, 8> kFolders = {"GL/",  "GLES2/", "GLES3/", "EGL/",
                                                        "KHR/", "epoxy/", "GLFW/",  "imgui"};
  return std::any_of(kFolders.begin(), kFolders.end(),
                     [&](std::string_view name) { return include.starts_with(name); });
}

/// What is wrong with an include of `file` (relative to the repository, in a room); empty if nothing.
std::string fault(const fs::path& file, const Include& include) {
  const std::string room = *parts(file).begin();
  const bool isPublic = parts(file).at(1) == "include";
  if (!include.angled || include.path.starts_with("hpsdf/")) {
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

/// The faults of a file's text, a line each: "path:line: include: fault".
Lines faults(const fs::path& file, const std::string& text) {
  Lines result;
  std::istringstream stream(text);
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    const auto include = parseInclude(line);
    if (!include) continue;
    if (const std::string what = fault(file, *include); !what.empty())
      result.push_back(file.string() + ":" + std::to_string(number) + ": " + include->path + ": " + what);
  }
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

TEST(IncludeDirection, runsOneWayInEveryRoom) {
  const fs::path root = HPSDF_SOURCE_DIR;
  const auto files = sourceFiles(root);
  std::size_t seen = 0;
  for (const fs::path& file : files) {
    const std::string text = read(root / file);
    seen += text.find("#include") != std::string::npos ? 1 : 0;
    for (const std::string& line : faults(file, text)) ADD_FAILURE() << line;
  }
  EXPECT_GT(seen, 20u) << "of " << files.size() << " files: the rooms were not found under " << root;
}

struct Sample {
  const char* file;
  const char* text;
};

TEST(IncludeDirection, acceptsWhatRunsTheRightWay) {
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
      {"core/src/mesh/shapes.cpp", "// not an include: \"hpsdf/render/view.h\"\nint include = 0;"},
  };
  for (const Sample& sample : samples)
    EXPECT_EQ(faults(sample.file, sample.text), Lines{}) << sample.file << "\n" << sample.text;
}

TEST(IncludeDirection, refusesWhatRunsTheWrongWay) {
  const Sample samples[] = {
      {"core/src/field/build/build.cpp", "#include \"hpsdf/render/view.h\""},
      {"core/src/field/build/build.cpp", "#include <hpsdf/render/view.h>"},
      {"core/src/field/build/build.cpp", "  #  include \"../../../../render/src/gl/context.h\"  // why not"},
      {"core/src/field/build/build.cpp", "#include \"app/src/language/registry.h\""},
      {"core/src/field/build/build.cpp", "#include \"hpsdf/physics/contacts.h\""},
      {"core/src/field/build/build.cpp", "#include <GL/gl.h>"},
      {"render/src/gl/context.cpp", "#include \"../../../app/src/language/registry.h\""},
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
      {"physics/include/hpsdf/physics/contacts.h", "#include \"sphere_tree.h\""},
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

}  // namespace
