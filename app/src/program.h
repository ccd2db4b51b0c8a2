#pragma once

#include <span>
#include <string>

#include "console/failed.h"
#include "session/session.h"

namespace hpsdf::app {

constexpr int kExitDone = 0;
constexpr int kExitBadInput = 2;
constexpr int kExitCancelled = 130;  // the status that shells report after SIGINT, 128 + 2

/// Runs the program. `words` are the command-line words after the program's name. Returns the exit status.
/// Never throws.
int runProgram(std::span<const std::string> words, const Console& console);

}  // namespace hpsdf::app
