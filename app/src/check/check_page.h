#pragma once
// The results of a check as an HTML page for people and as JUnit XML for CI.

#include <string>

#include "check/check.h"

namespace hpsdf::app {

/// A page with the results of all comparisons and the pictures of each failure, which are embedded in the page. It
/// names the commands that repeat the check, and that accept a picture.
std::string checkHtml(const CheckOutcome& outcome, const CheckRequest& request);

/// JUnit XML with a test suite for each script and a test case for each picture.
std::string junitXml(const CheckOutcome& outcome);

}  // namespace hpsdf::app
