#pragma once

#include <span>
#include <string>

#include "console/failed.h"
#include "session/session.h"

namespace hpsdf::app {

constexpr int kExitDone = 0;
constexpr int kExitBadInput = 2;
constexpr int kExitCancelled = 130;  // 128 + SIGINT, as shells count

/// The program without its process: the words after its name in, exit status out. Never throws.
int runProgram(std::span<const std::string> words, const Console& console);

}  // namespace hpsdf::app
