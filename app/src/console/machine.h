#pragma once
// What this program runs on, for `doctor`.

#include <string>
#include <utility>
#include <vector>

namespace hpsdf::app {

/// Instruction sets beyond the baseline, widest last, and whether this processor has them. Empty where it is not x86.
std::vector<std::pair<std::string, bool>> simdOfCpu();

std::string processorName();
std::string compilerText();
std::string assimpVersion();

}  // namespace hpsdf::app
