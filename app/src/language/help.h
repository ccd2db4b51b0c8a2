#pragma once
// Makes the help texts and the page docs/commands.md from the registry.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "language/registry.h"

namespace hpsdf::app {

enum class HelpDetail : std::uint8_t {
  common,  ///< without advanced options; the last line tells how many were left out
  all,
};

/// Returns the help text of the program, with an example of a first session and a list of all commands.
std::string overviewHelp(const Registry& registry);

/// Returns the help text of one command: usage, purpose, examples, and its parameters by group.
std::string commandHelp(const Command& command, HelpDetail detail);

/// Returns the text of the page docs/commands.md. An option that several commands share is described only
/// once: with the command `build` if it is an option of the construction, and otherwise in the section
/// "Shared options".
std::string commandsMarkdown(const Registry& registry);

/// Returns descriptions of all commands and their parameters as JSON.
nlohmann::ordered_json commandsJson(const Registry& registry);

}  // namespace hpsdf::app
