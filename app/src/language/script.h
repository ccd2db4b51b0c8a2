#pragma once
// Scripts: a command a line, `verb value key=value …`; docs/scripts.md is the manual.

#include <cstddef>
#include <filesystem>
#include <istream>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "language/registry.h"

namespace hpsdf::app {

using Variables = std::map<std::string, std::string, std::less<>>;

/// A checked command of a script.
struct Call {
  const Command* command;
  Arguments arguments;
  std::string where;         ///< "file:line:column" of the verb
  std::string includedFrom;  ///< " (included from file:line:column, …)", which ends messages; "" in the script itself
  int line;                  ///< in the script itself: of an included call, that of the `include`
};

/// Reads and checks a whole script, so that a mistake in the last line shows before the first has run. `name` stands
/// in messages, and is what included files are looked for beside; `variables` replace $name. The calls refer to the
/// registry's commands. Throws `Error` "file:line:column: …".
std::vector<Call> parseScript(const Registry& registry, std::string_view name, std::string_view text,
                              Variables variables);

/// Runs the calls one after another; stops at the first that throws, and says where.
void runScript(Session& session, std::span<const Call> calls);

/// What a person writes by hand or by a script of a few lines, a script of ours or a list, is never as long.
constexpr std::size_t kMostTextBytes = std::size_t{1} << 26;

/// All of a text that is called `name` in messages. Throws `Error` where it is longer than `kMostTextBytes`, or cannot
/// be read to its end.
std::string readText(std::istream& in, const std::string& name);
/// The same of a file; throws `Error` also where it is missing, a folder or a device, which may have no end.
std::string readTextFile(const std::string& file);
/// All of a file of any length, such as a picture or a table. Throws `Error` as `readTextFile` otherwise.
std::string readWholeFile(const std::string& file);
/// The last line that is not empty; "" where there is none.
std::string lastLine(const std::string& text);
/// Throws `Error` naming it; then nothing of it is left behind.
void writeTextFile(const std::filesystem::path& file, std::string_view text);

/// "name=value" words. Throws `Error` for one that is not of that form.
Variables parseVariables(const std::vector<std::string>& words);

bool isVariableAssignment(std::string_view word);

}  // namespace hpsdf::app
