#pragma once
// Runs a folder's scripts and compares what they write with the folder's baselines; docs/check.md is the manual.

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
  noPicture,     ///< a baseline that no script writes
  unreadable,    ///< the picture, its baseline or the JSON beside that
  expected,      ///< a script whose expectation does not hold
  scriptFailed,  ///< as a whole
  notNoticed,    ///< a wrong picture that passes
  otherReason,   ///< a wrong picture that fails, but not as stated
};
std::string verdictText(Verdict verdict);

struct WorstPlace {
  std::string place;
  std::string baseline;  ///< "#rrggbb" of a picture, a number of raw values
  std::string actual;
  std::string difference;
};

/// A picture, or raw values, and its baseline; or a script that failed, or that wrote nothing.
struct CheckedItem {
  std::string script = {};
  std::string picture = {};  ///< file name; "" of a script
  int controlLine = 0;       ///< of the negative control that wrote it; 0 for what is meant to be right
  Verdict verdict = Verdict::passed;
  std::string problem = {};  ///< one line; "" where all is well
  std::size_t compared = 0;  ///< pixels or values
  std::size_t differing = 0;
  double largest = 0;
  double budget = 0;  ///< share of them that may differ
  std::string renderer = {};
  std::string baselineRenderer = {};
  std::string where = {};                 ///< "file:line:column" of the command that wrote it
  std::filesystem::path baseline = {};    ///< whether it exists or not
  std::filesystem::path actual = {};      ///< whether it exists or not
  std::filesystem::path difference = {};  ///< "" where there is none
  std::vector<WorstPlace> worst = {};

  /// "gallery/degree.png", or a script's name
  std::string name() const { return picture.empty() ? script : script + "/" + picture; }
  /// "degree.png", or "degree.png, wrong in line 7" of a negative control, or "(script)"
  std::string pictureText() const;
  /// The script and that
  std::string title() const { return picture.empty() ? script : script + "/" + pictureText(); }
};

struct CheckRequest {
  std::filesystem::path folder;
  std::filesystem::path output;
  std::vector<std::string> only = {};  ///< names of scripts; all when empty
  Variables variables = {};
  std::filesystem::path junit = {};  ///< to be written afterwards, and tried before the work; "" for none
};

struct CheckOutcome {
  std::vector<CheckedItem> items = {};         ///< script by script, in the order of their names
  std::map<std::string, double> seconds = {};  ///< that each script took

  std::size_t failures() const;
  bool scriptFailed() const;
};

constexpr const char* kCheckResults = "results.json";

/// Writes pictures and differences into the output folder, which is emptied before of what an earlier check left there.
/// Throws `Error` for a folder without scripts, an unknown name in `only`, an output folder with other things in it.
CheckOutcome check(const Registry& registry, const Console& console, const CheckRequest& request);

}  // namespace hpsdf::app
