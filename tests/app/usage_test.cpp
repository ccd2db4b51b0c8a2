// Tests that the scripts run by `hpsdf check` use every command and every control of the explorer.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <vector>

#include "commands/commands.h"
#include "explorer/explorer.h"
#include "files/text_file.h"
#include "language/script.h"
#include "support/require_gl.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace usage_test {

namespace fs = std::filesystem;
using ::testing::IsEmpty;

const fs::path kScripts = fs::path(HPSDF_SOURCE_DIR) / "screenshots/scripts";

std::vector<Call> callsOf(const Registry& registry, const fs::path& script, const fs::path& folder) {
  const Variables variables = {{"out", folder.string()},
                               {"wrong", folder.string()},
                               {"here", script.parent_path().string()},
                               {"mesh", "builtin:torus"}};
  return parseScript(registry, script.string(), readTextFile(script.string()), variables);
}

std::vector<fs::path> scripts() {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(kScripts))
    if (entry.path().extension() == ".hps") found.push_back(entry.path());
  return found;
}

/// Maps a control's path to its kind: all entries of a list count as one control, and so do all rows of a table.
std::string controlOf(const std::string& path) {
  const std::size_t panel = path.find('/');
  if (panel == std::string::npos) return path;
  const std::size_t entry = path.find('/', panel + 1);
  if (entry != std::string::npos) return path.substr(0, entry) + "/…";
  const std::string name = path.substr(panel + 1);
  return name.find_first_not_of("0123456789") == std::string::npos ? path.substr(0, panel) + "/…" : path;
}

TEST(Usage, everyCommandIsInACheckedScript) {
  const Registry registry = makeRegistry();
  const support::TemporaryDirectory folder;
  // Scripts of `check` cannot run `check` or open a window, and `simulate` needs a library that may be missing. The
  // calls of a script contain those of included scripts, but not `include` itself; so it is searched for in the text.
  std::set<std::string> unused;
  for (const Command& command : registry.commands()) unused.insert(command.name);
  for (const char* exempt : {"check", "accept", "view", "simulate"}) unused.erase(exempt);
  for (const fs::path& script : scripts()) {
    for (const Call& call : callsOf(registry, script, folder.path())) unused.erase(call.command->name);
    if (readTextFile(script.string()).find("\ninclude ") != std::string::npos) unused.erase("include");
  }
  EXPECT_THAT(unused, IsEmpty());
}

TEST(Usage, everyControlOfTheExplorerIsInACheckedScript) {
  HPSDF_REQUIRE_GL();
  const Registry registry = makeRegistry();
  const support::TemporaryDirectory folder;
  std::set<std::string> seen, used, withoutTooltip;
  std::istringstream in;
  std::ostringstream out, err;
  Session session(registry, Console{in, out, err});
  for (const Call& call : callsOf(registry, kScripts / "explorer.hps", folder.path())) {
    runScript(session, std::span(&call, 1));
    if (call.command->name == "ui") used.insert(controlOf(call.arguments.text("target")));
    for (const auto& [path, widget] : explorerOf(session).widgets()) {
      seen.insert(controlOf(path));
      const bool isEntry = std::ranges::count(path, '/') > 1;  // the list has the tooltip
      if (widget.isControl && !isEntry && widget.help.empty()) withoutTooltip.insert(path);
    }
  }
  std::set<std::string> unused;
  std::ranges::set_difference(seen, used, std::inserter(unused, unused.end()));
  unused.erase("build/progress");  // shows progress and takes no input
  unused.erase("build/cancel");    // exists only during a construction; window_test.cpp covers it
  EXPECT_THAT(unused, IsEmpty());
  EXPECT_THAT(withoutTooltip, IsEmpty());
  EXPECT_GT(seen.size(), 60u);
  for (const char* control : {"view/cells/…", "worst/…", "build/rebuild", "canvas", "beside"})
    EXPECT_TRUE(seen.contains(control)) << control;
}

}  // namespace usage_test
}  // namespace hpsdf::app
