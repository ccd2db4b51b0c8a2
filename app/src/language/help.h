#pragma once
// Help texts and docs/commands.md, made from the registry.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "language/registry.h"

namespace hpsdf::app {

enum class HelpDetail : std::uint8_t {
  common,  ///< without options of `ParameterKind::isAdvanced`; the last line tells how many were left out
  all,
};

/// Describes the program, a first session and all commands.
std::string overviewHelp(const Registry& registry);

/// Describes one command: usage, purpose, examples, and its parameters by group.
std::string commandHelp(const Command& command, HelpDetail detail);

/// Returns the page docs/commands.md. An option that several commands share is described once: with `build` where it
/// belongs to the construction, else in the section "Shared options".
std::string commandsMarkdown(const Registry& registry);

/// Returns commands and parameters as JSON.
nlohmann::ordered_json commandsJson(const Registry& registry);

}  // namespace hpsdf::app
