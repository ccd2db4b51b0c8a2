#pragma once
// What a check found, for people (one HTML page that can be mailed) and for CI (JUnit's XML).

#include <string>

#include "check/check.h"

namespace hpsdf::app {

struct CheckPage {
  std::string title;
  std::string checkCommand;   ///< that repeats the check, but for --only
  std::string acceptCommand;  ///< that takes a picture, but for its name
  std::string footer;
};

/// All figures, and of each failure its pictures, read from their files and kept in the page itself.
std::string checkHtml(const CheckOutcome& outcome, const CheckPage& page);

/// A suite a script, a case a picture.
std::string junitXml(const CheckOutcome& outcome);

}  // namespace hpsdf::app
