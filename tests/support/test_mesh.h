#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace hpsdf::support {

/// The folder of test meshes, named by the environment variable HPSDF_MESHES; empty where it is not set.
inline std::filesystem::path meshFolder() {
  const char* folder = std::getenv("HPSDF_MESHES");
  return folder == nullptr ? std::filesystem::path() : std::filesystem::path(folder);
}

/// A mesh of that folder, e.g. testMesh("paper/bunny_69k.obj"), after HPSDF_SKIP_WITHOUT_MESHES(). Whether the file is
/// there is not asked: one missing from a folder that is set is a failure for the import to report, no reason to skip.
inline std::filesystem::path testMesh(const std::filesystem::path& name) { return meshFolder() / name; }

}  // namespace hpsdf::support

/// Skips the test where there is no folder of test meshes. Returns: for the body of a test or of SetUp.
#define HPSDF_SKIP_WITHOUT_MESHES()                                                                                   \
  do {                                                                                                                \
    if (::hpsdf::support::meshFolder().empty()) GTEST_SKIP() << "HPSDF_MESHES is not set to a folder of test meshes"; \
  } while (false)
