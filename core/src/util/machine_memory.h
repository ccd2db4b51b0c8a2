#pragma once

#include <filesystem>

namespace hpsdf::detail {

/// The bytes that control groups of version 1 and 2 allow this process, infinity without a limit: the least limit of
/// its own group and of the groups above. `root` is the folder that contains proc and sys.
double memoryOfControlGroups(const std::filesystem::path& root = "/");

/// The bytes of the machine's memory, or fewer where control groups limit this process. The first call reads them.
double machineMemory();

}  // namespace hpsdf::detail
