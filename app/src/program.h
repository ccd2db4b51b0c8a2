#pragma once

#include <span>
#include <string>

#include "hpsdf/app/failed.h"
#include "session/session.h"

namespace hpsdf::app {

constexpr int kExitDone = 0;
constexpr int kExitBadInput = 2;
constexpr int kExitSignal = 128;      // added to a signal's number, as shells do
constexpr int kExitCancelled = 130;   // the status after SIGINT, 128 + 2
constexpr int kExitReaderGone = 141;  // the status of programs that SIGPIPE ends, 128 + 13

/// Runs the program. `words` are the command-line words after the program's name. Returns the exit status.
/// Never throws.
int runProgram(std::span<const std::string> words, const Console& console);

}  // namespace hpsdf::app
