#pragma once

#include <filesystem>

namespace hpsdf {

/// Bytes that this process's control groups allow it, which is infinity where they set no limit: the least of its own
/// and of those above that, of version 1 and 2. `root`: the folder in which proc and sys lie.
double memoryOfControlGroups(const std::filesystem::path& root = "/");

/// Bytes that this process can have at most: the machine's, or less where its control groups say so. Asked once.
double machineMemory();

}  // namespace hpsdf
