#pragma once
// Runs the scripts of a folder and compares the files that they write with the baselines in the folder.
// docs/check.md is the manual.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "language/script.h"
#include "session/session.h"

namespace hpsdf::app {

enum class Verdict : std::uint8_t {
  passed,
  differs,
  otherSize,
  noBaseline,
  noPicture,     ///< a baseline for which no script writes a file
  unreadable,    ///< a file that cannot be read: the picture, its baseline or the baseline's JSON file
  expected,      ///< a script whose expectation does not hold
  scriptFailed,  ///< a script that ended with an error
  notNoticed,    ///< a deliberately wrong picture that agrees with the baseline
  otherReason,   ///< a deliberately wrong picture that fails for another reason than stated
};
std::string verdictText(Verdict verdict);

/// One of the largest differences between a file and its baseline.
struct WorstDifference {
  std::string position;  ///< pixel, or row and column
  std::string baseline;  ///< "#rrggbb" for a picture, a number for raw values
  std::string actual;
  std::string difference;
};

/// The result for one picture or file of raw values that was compared with its baseline, or for one script that failed
/// or wrote no files.
struct CheckedItem {
  std::string script = {};
  std::string picture = {};  ///< file name; "" for a script
  int controlLine = 0;       ///< script line that drew the picture wrong on purpose; 0 for other pictures
  Verdict verdict = Verdict::passed;
  std::string problem = {};  ///< reason of the failure in one line; "" if the item passed
  std::size_t compared = 0;  ///< number of compared pixels or values
  std::size_t differing = 0;
  double largest = 0;  ///< largest difference of a pixel or value
  double budget = 0;   ///< share of pixels or values that may differ
  std::string renderer = {};
  std::string baselineRenderer = {};
  std::string where = {};                 ///< "file:line:column" of the command that wrote the file
  std::filesystem::path baseline = {};    ///< path of the accepted file, which may be missing
  std::filesystem::path actual = {};      ///< path of the new file, which may be missing
  std::filesystem::path difference = {};  ///< path of a picture of the differences; "" for none
  /// Page of the field that drew the file, in the same view, relative to the folder of the results; "" for none.
  std::filesystem::path live = {};
  std::vector<WorstDifference> worst = {};

  /// Returns the name of the item: "gallery/degree.png" for a picture, or "gallery" if the item is the script itself.
  std::string name() const { return picture.empty() ? script : script + "/" + picture; }
  /// Returns the name of the picture, such as "degree.png". Returns "degree.png, wrong in line 7" for a picture that is
  /// wrong on purpose, and "(script)" if the item is a script.
  std::string pictureText() const;
  /// Returns the title "script/picture", such as "gallery/degree.png", or only the script's name if the item is a
  /// script.
  std::string title() const { return picture.empty() ? script : script + "/" + pictureText(); }
};

struct CheckRequest {
  std::filesystem::path folder;
  std::filesystem::path output;
  std::vector<std::string> only = {};  ///< names of the scripts to run; empty for all
  Variables variables = {};
  std::filesystem::path junit = {};  ///< JUnit XML file; "" for none
};

struct CheckOutcome {
  std::vector<CheckedItem> items = {};         ///< results of all scripts, sorted by script name
  std::map<std::string, double> seconds = {};  ///< time that each script took, by script name

  std::size_t failures() const;
  bool scriptFailed() const;
};

constexpr const char* kCheckResults = "results.json";

/// Runs the scripts. Writes their pictures, and pictures that show the differences from the baselines, into the output
/// folder. Results of an earlier check are first removed from the output folder. Throws `Error` for a folder without
/// scripts, for an unknown script name in `request.only`, and for an output folder that contains other files.
CheckOutcome check(const Registry& registry, const Console& console, const CheckRequest& request);

/// Returns an HTML page with the results of all comparisons. The pictures of each failure are embedded in the
/// page. The page names the command that repeats the check and the command that accepts a picture.
std::string checkHtml(const CheckOutcome& outcome, const CheckRequest& request);

/// Returns the results as JUnit XML, with a test suite for each script and a test case for each picture.
std::string junitXml(const CheckOutcome& outcome);

}  // namespace hpsdf::app
