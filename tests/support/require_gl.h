#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "hpsdf/error.h"
#include "hpsdf/render/renderer.h"

namespace hpsdf::support {

/// Why the software device that the tests ask for does not serve; empty where it does.
inline std::string glProblem() {
  try {
    render::glDescription(render::GlChoice::software);
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

/// Set by `.ci/run`, where a test skipped for want of EGL would hide that nothing was tested.
inline bool glRequired() {
  const char* value = std::getenv("HPSDF_REQUIRE_GL");
  return value != nullptr && std::string(value) == "1";
}

}  // namespace hpsdf::support

/// Skips the test where there is no OpenGL, or fails it where HPSDF_REQUIRE_GL=1. Returns: for the body of a test or of
/// SetUp.
#define HPSDF_REQUIRE_GL()                                                                  \
  do {                                                                                      \
    const std::string hpsdfGlProblem = ::hpsdf::support::glProblem();                       \
    if (hpsdfGlProblem.empty()) break;                                                      \
    if (::hpsdf::support::glRequired()) FAIL() << "HPSDF_REQUIRE_GL=1: " << hpsdfGlProblem; \
    GTEST_SKIP() << hpsdfGlProblem;                                                         \
  } while (false)
