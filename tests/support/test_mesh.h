#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace hpsdf::support {

/// Returns the folder of test meshes, named by the environment variable HPSDF_MESHES; empty if it is not set.
inline std::filesystem::path meshFolder() {
  const char* folder = std::getenv("HPSDF_MESHES");
  return folder == nullptr ? std::filesystem::path() : std::filesystem::path(folder);
}

/// Returns the path of a test mesh, e.g. testMesh("paper/bunny_69k.obj"), after HPSDF_SKIP_WITHOUT_MESHES(). If the
/// folder lacks this file, the import fails, and so does the test.
inline std::filesystem::path testMesh(const std::filesystem::path& name) { return meshFolder() / name; }

}  // namespace hpsdf::support

/// Skips the test if there is no folder of test meshes: returns from the body of a test or SetUp that uses it.
#define HPSDF_SKIP_WITHOUT_MESHES()                                                                                   \
  do {                                                                                                                \
    if (::hpsdf::support::meshFolder().empty()) GTEST_SKIP() << "HPSDF_MESHES is not set to a folder of test meshes"; \
  } while (false)
