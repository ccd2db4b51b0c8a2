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

/// "name=value" words. Throws `Error` for one that is not of that form.
Variables parseVariables(const std::vector<std::string>& words);

bool isVariableAssignment(std::string_view word);

}  // namespace hpsdf::app
