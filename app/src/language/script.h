#pragma once
// Scripts hold one command per line, `verb value key=value …`; docs/scripts.md is the manual.

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

/// One command of a script with its checked arguments, ready to run.
struct Call {
  const Command* command;
  Arguments arguments;
  std::string where;         ///< "file:line:column" of the verb
  std::string includedFrom;  ///< suffix of messages, " (included from file:line:column, …)"; "" in the outermost script
  int line;                  ///< line in the outermost script; for an included call the line of its `include`
};

/// Parses a script into calls of commands. Checks the whole script first, so that a mistake in the last line is found
/// before the first line runs. `name` is the file name of the script: error messages begin with this name, and included
/// files are searched in the script's folder. Words of the form $name are replaced by the values in `variables`. The
/// registry must outlive the calls, which refer to its commands. Throws `Error` with a message "file:line:column: …".
std::vector<Call> parseScript(const Registry& registry, std::string_view name, std::string_view text,
                              Variables variables);

/// Runs the calls in order. The first error ends the script; the error message then begins with the position
/// of the failed call.
void runScript(Session& session, std::span<const Call> calls);

/// Parses words of the form name=value. Throws `Error` for any other word.
Variables parseVariables(const std::vector<std::string>& words);

}  // namespace hpsdf::app
