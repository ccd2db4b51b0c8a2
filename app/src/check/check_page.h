#pragma once
// The results of a check as an HTML page for people and as JUnit XML for CI.

#include <string>

#include "check/check.h"

namespace hpsdf::app {

struct CheckPage {
  std::string title;
  std::string checkCommand;   ///< command that repeats the check, without --only
  std::string acceptCommand;  ///< command that accepts a picture, without the picture's name
  std::string footer;
};

/// A page with the results of all comparisons and the pictures of each failure, which are embedded in the page.
std::string checkHtml(const CheckOutcome& outcome, const CheckPage& page);

/// JUnit XML with a test suite for each script and a test case for each picture.
std::string junitXml(const CheckOutcome& outcome);

}  // namespace hpsdf::app
