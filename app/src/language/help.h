#pragma once
// Help, from the registry alone.

#include <nlohmann/json.hpp>
#include <string>

#include "language/registry.h"

namespace hpsdf::app {

/// What the program is, a first session, all commands.
std::string overviewHelp(const Registry& registry);

std::string commandHelp(const Command& command);

/// docs/commands.md.
std::string commandsMarkdown(const Registry& registry);

nlohmann::ordered_json commandsJson(const Registry& registry);

}  // namespace hpsdf::app
