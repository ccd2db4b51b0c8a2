#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "hpsdf/error.h"
#include "hpsdf/render/renderer.h"

namespace hpsdf::support {

/// Returns the kind of OpenGL device that the tests draw on: the software device, or a graphics card if the environment
/// variable HPSDF_TEST_GL is "hardware".
inline render::GlChoice testedGl() {
  const char* value = std::getenv("HPSDF_TEST_GL");
  const bool hardware = value != nullptr && std::string(value) == "hardware";
  return hardware ? render::GlChoice::hardware : render::GlChoice::software;
}

/// Returns why the OpenGL device of the tests cannot be used; empty if it can.
inline std::string glProblem() {
  try {
    render::glDescription(testedGl());
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

/// True if a missing OpenGL must fail the tests instead of skipping them: `.ci/run` sets HPSDF_REQUIRE_GL=1.
inline bool glRequired() {
  const char* value = std::getenv("HPSDF_REQUIRE_GL");
  return value != nullptr && std::string(value) == "1";
}

}  // namespace hpsdf::support

/// Skips the test without OpenGL, or fails it if HPSDF_REQUIRE_GL=1. It returns from the function that uses it, which
/// must be the body of a test or SetUp.
#define HPSDF_REQUIRE_GL()                                                                  \
  do {                                                                                      \
    const std::string hpsdfGlProblem = ::hpsdf::support::glProblem();                       \
    if (hpsdfGlProblem.empty()) break;                                                      \
    if (::hpsdf::support::glRequired()) FAIL() << "HPSDF_REQUIRE_GL=1: " << hpsdfGlProblem; \
    GTEST_SKIP() << hpsdfGlProblem;                                                         \
  } while (false)
