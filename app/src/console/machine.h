#pragma once
// Describes the machine and the build for `doctor`.

#include <string>
#include <utility>
#include <vector>

namespace hpsdf::app {

/// Lists the instruction sets beyond the baseline, widest last, and whether this processor has them. The list is empty
/// on other architectures than x86.
std::vector<std::pair<std::string, bool>> simdOfCpu();

std::string processorName();
std::string compilerText();
std::string assimpVersion();

}  // namespace hpsdf::app
