#include "check/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <set>
#include <sstream>
#include <utility>

#include "check/baseline.h"
#include "console/console.h"
#include "files/data_table.h"
#include "files/output_folder.h"
#include "files/text_file.h"
#include "hpsdf/app/failed.h"
#include "hpsdf/detail/nearest_name.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/render/compare.h"
#include "pictures/field_page.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kWorstPixels = 10;
constexpr int kMostPages = 4;  // of fields that drew failed pictures of a script, because each takes megabytes

void setVerdict(CheckedItem& item, Verdict verdict, const std::string& problem) {
  item.verdict = verdict;
  item.problem = problem;
}

/// Stores the results of a comparison in the item: the number and size of the differences and, if `problem` is not
/// empty, the verdict that the item failed.
void takeComparison(CheckedItem& item, const auto& comparison, bool sameShape, const std::string& problem) {
  item.compared = comparison.compared;
  item.differing = comparison.differing;
  item.largest = comparison.largest;
  if (!problem.empty()) setVerdict(item, sameShape ? Verdict::differs : Verdict::otherSize, problem);
}

void judgePicture(CheckedItem& item) {
  const render::Image baseline = render::loadPng(item.baseline);
  const render::Image actual = render::loadPng(item.actual);
  const render::Comparison comparison = render::compare(baseline, actual);
  takeComparison(item, comparison, comparison.sameSize(), render::problem(comparison, item.budget));
  if (item.verdict != Verdict::differs || item.difference.empty()) return;
  for (const render::PixelDifference& pixel : render::worstPixels(baseline, actual, kWorstPixels))
    item.worst.push_back({fmt::format("x {}, y {}", pixel.x, pixel.y), colorText(pixel.baseline),
                          colorText(pixel.actual), std::to_string(pixel.difference)});
  fs::create_directories(item.difference.parent_path());
  savePng(render::differencePicture(baseline, actual), item.difference);
}

void judgeData(CheckedItem& item, double bound) {
  const DataComparison comparison = compare(loadData(item.baseline), loadData(item.actual), bound);
  takeComparison(item, comparison, comparison.sameShape, problem(comparison, bound, item.budget));
  if (item.verdict == Verdict::passed) return;
  for (const DataDifference& worst : comparison.worst)
    item.worst.push_back({fmt::format("row {}, column {}", worst.row + 1, worst.column + 1),
                          fmt::format("{}", worst.baseline), fmt::format("{}", worst.actual),
                          fmt::format("{:.3g}", worst.difference)});
}

/// Compares the file that a script wrote with its baseline and sets the item's verdict. Either file may be missing.
void judge(CheckedItem& item) {
  if (!fs::exists(item.actual))
    return setVerdict(item, Verdict::noPicture,
                      "no script writes it: remove the baseline, or correct the script that should write it");
  if (!fs::exists(item.baseline))
    return setVerdict(item, Verdict::noBaseline, "it has no baseline: look at it, then 'hpsdf accept' it");
  try {
    const BaselineFacts facts = loadFacts(item.baseline);
    item.baselineRenderer = facts.renderer;
    item.budget = facts.budget.value_or(render::kPixelBudget);
    isDataFile(item.picture) ? judgeData(item, facts.bound.value_or(kDataBound)) : judgePicture(item);
  } catch (const Error& error) {
    setVerdict(item, Verdict::unreadable, error.what());
  }
  if (item.verdict != Verdict::differs || isDataFile(item.picture)) item.difference.clear();
}

/// Reverses the verdict on a negative control, a picture that is wrong on purpose. The control passes only if its
/// comparison failed with the verdict `stated`.
void reverseVerdict(CheckedItem& item, Verdict stated) {
  if (item.verdict == stated)
    setVerdict(item, Verdict::passed, "");
  else if (item.verdict == Verdict::passed)
    setVerdict(item, Verdict::notNoticed, "it is meant to be wrong, and agrees with the baseline");
  else if (item.verdict == Verdict::differs || item.verdict == Verdict::otherSize)
    setVerdict(item, Verdict::otherReason,
               fmt::format("it is meant to fail with '{}', but: {}", verdictText(stated), item.problem));
}

using NegativeControls = std::map<int, Verdict>;  ///< expected verdicts on deliberately wrong pictures, by script line

/// Uncomments the commands in the lines "# wrong REASON: COMMAND" of a script. They draw wrong pictures on purpose.
/// Returns the verdict that is expected for each of these lines. Every command keeps its line and column, so that error
/// messages stay correct.
NegativeControls enableControls(const std::string& file, std::string& text) {
  NegativeControls controls;
  std::size_t begin = 0;
  for (int line = 1; begin < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::size_t hash = text.find_first_not_of(" \t", begin);
    std::istringstream words(text.substr(begin, end - begin));
    std::string first, second, reason;
    words >> first >> second >> reason;
    if (hash < end && (first == "#wrong" || (first == "#" && (second == "wrong" || second == "wrong:")))) {
      if (reason != "pixels:" && reason != "values:" && reason != "size:")
        throw Error(
            fmt::format("{}:{}:{}: expected '# wrong pixels: COMMAND', '# wrong values: COMMAND' or "
                        "'# wrong size: COMMAND'",
                        file, line, hash - begin + 1));
      controls[line] = reason == "size:" ? Verdict::otherSize : Verdict::differs;
      std::fill(text.begin() + std::ptrdiff_t(hash), text.begin() + std::ptrdiff_t(text.find(':', hash)) + 1, ' ');
    }
    begin = end + 1;
  }
  return controls;
}

/// Returns the names of the folder's pictures and raw-value files, sorted.
std::set<std::string> comparableFiles(const fs::path& folder) {
  std::set<std::string> names;
  if (!fs::is_directory(folder)) return names;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && isComparable(entry.path())) names.insert(entry.path().filename().string());
  return names;
}

class ScriptCheck {
 public:
  ScriptCheck(const CheckRequest& request, std::string name)
      : request_(request),
        name_(std::move(name)),
        file_((request.folder / "scripts" / (name_ + ".hps")).string()),
        baselines_(request.folder / "baselines" / name_),
        actual_(request.output / "actual" / name_),
        wrong_(request.output / "wrong" / name_) {}

  std::vector<CheckedItem> run(const Registry& registry, const Console& console) {
    fs::create_directories(actual_);
    bool completed = true;
    try {
      runCalls(registry, console);
    } catch (const Error& error) {
      completed = false;
      const bool isExpectation = dynamic_cast<const Failed*>(&error) != nullptr;
      items_.push_back({.script = name_,
                        .verdict = isExpectation ? Verdict::expected : Verdict::scriptFailed,
                        .problem = error.what(),
                        .where = file_});
    }
    judgePictures(completed);
    return std::move(items_);
  }

 private:
  struct Origin {
    fs::file_time_type time;
    std::string where;
    std::string renderer;
    fs::path live;
  };

  void runCalls(const Registry& registry, const Console& console) {
    std::string text = readTextFile(file_);
    const NegativeControls controls = enableControls(file_, text);
    Variables variables = request_.variables;
    variables["out"] = actual_.string();
    variables["wrong"] = wrong_.string();
    variables["here"] = fs::path(file_).parent_path().string();
    const std::vector<Call> calls = parseScript(registry, file_, text, variables);
    for (const auto& [line, stated] : controls)
      if (std::ranges::find(calls, line, &Call::line) == calls.end())
        throw Error(fmt::format("{}:{}: expected a command after the colon", file_, line));
    if (!controls.empty()) fs::create_directories(wrong_);
    std::istringstream nothing;
    std::ostringstream ignored;  // takes the reports that commands write to standard output
    Session session(registry, {nothing, ignored, console.err, console.redrawsProgress});
    session.scriptDepth = 1;
    for (std::size_t n = 0; n < calls.size(); ++n) {
      runScript(session, std::span(calls).subspan(n, 1));
      const auto control = controls.find(calls[n].line);
      const bool lineEnds = n + 1 == calls.size() || calls[n + 1].line != calls[n].line;
      if (control == controls.end())
        notePictures(session, calls[n]);
      else if (lineEnds)
        judgeControl(session, calls[n], control->second);
    }
  }

  /// Records for each picture or raw-value file which command of the script wrote it.
  void notePictures(Session& session, const Call& call) {
    for (const std::string& picture : comparableFiles(actual_)) {
      const auto time = fs::last_write_time(actual_ / picture);
      const auto known = origins_.find(picture);
      if (known != origins_.end() && known->second.time == time) continue;
      origins_[picture] = {time, call.where, session.lastRenderer(), {}};
      if (call.command->view && keptPages_ < kMostPages && !agrees(picture))
        origins_[picture].live = keptField(session, call, picture);
    }
  }

  CheckedItem itemOf(const std::string& picture) const {
    return {.script = name_, .picture = picture, .baseline = baselines_ / picture, .actual = actual_ / picture};
  }

  bool agrees(const std::string& picture) const {
    CheckedItem item = itemOf(picture);
    judge(item);
    return item.verdict == Verdict::passed;
  }

  /// Writes a page of the current field in the view that the command has drawn, because a later command may replace the
  /// field. Returns its path within the folder of the results, or "" if pages cannot show the field.
  fs::path keptField(Session& session, const Call& call, const std::string& picture) {
    const CurrentField& current = session.current();
    if (!refusal(current.field).empty()) return {};
    FieldPage page;
    page.add(current.field,
             {.name = plainName(current.name), .view = pageView(call.command->view(session, call.arguments))});
    const fs::path file = fs::path("live") / name_ / (picture + ".html");
    fs::create_directories((request_.output / file).parent_path());
    writeTextFile(request_.output / file, page.html(name_ + "/" + picture));
    ++keptPages_;
    return file;
  }

  /// Compares the deliberately wrong files that a command has just written with the baselines of the same names.
  void judgeControl(const Session& session, const Call& call, Verdict stated) {
    const fs::path kept = wrong_ / std::to_string(call.line);
    const auto pictures = comparableFiles(wrong_);
    if (pictures.empty()) throw Error(call.where + ": expected a control to write a picture into $wrong");
    fs::create_directories(kept);
    for (const std::string& picture : pictures) {
      fs::rename(wrong_ / picture, kept / picture);
      CheckedItem item{.script = name_,
                       .picture = picture,
                       .controlLine = call.line,
                       .renderer = session.lastRenderer(),
                       .where = call.where,
                       .baseline = baselines_ / picture,
                       .actual = kept / picture};
      judge(item);
      reverseVerdict(item, stated);
      items_.push_back(item);
    }
  }

  /// Compares the files that the script wrote with their baselines. If the script ran to its end, each baseline for
  /// which it wrote no file counts as a failure.
  void judgePictures(bool completed) {
    std::vector<CheckedItem> judged;
    std::set<std::string> pictures = comparableFiles(actual_);
    if (completed) pictures.merge(comparableFiles(baselines_));
    for (const std::string& picture : pictures) {
      CheckedItem item = itemOf(picture);
      item.renderer = origins_[picture].renderer;
      item.where = origins_[picture].where;
      item.live = origins_[picture].live;
      item.difference = request_.output / "difference" / name_ / picture;
      judge(item);
      judged.push_back(item);
    }
    items_.insert(items_.begin(), judged.begin(), judged.end());
    if (items_.empty()) items_.push_back({.script = name_, .where = file_});  // a script without pictures is listed too
  }

  const CheckRequest& request_;
  std::string name_;
  std::string file_;
  fs::path baselines_, actual_, wrong_;
  std::map<std::string, Origin> origins_;
  int keptPages_ = 0;
  std::vector<CheckedItem> items_;
};

std::vector<std::string> scriptNames(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder / "scripts", ignored))
    if (entry.path().extension() == ".hps") names.push_back(entry.path().stem().string());
  std::ranges::sort(names);
  if (names.empty())
    throw Error(
        fmt::format("{}: has no scripts: expected {}", folder.string(), (folder / "scripts" / "NAME.hps").string()));
  return names;
}

/// Throws `Error` if `only` contains a name that is not the name of a script.
void refuseUnknown(const std::vector<std::string>& names, const std::vector<std::string>& only) {
  for (const std::string& name : only) {
    if (std::ranges::find(names, name) != names.end()) continue;
    throw Error(fmt::format("no script is named '{}'; {}", name,
                            didYouMean(name, names, "give the name of its file without .hps")));
  }
}

/// Returns a failed item for each baseline whose script does not exist.
std::vector<CheckedItem> strayBaselines(const CheckRequest& request, const std::vector<std::string>& scripts) {
  std::vector<CheckedItem> items;
  std::error_code ignored;
  std::set<std::string> folders;
  for (const auto& entry : fs::directory_iterator(request.folder / "baselines", ignored))
    folders.insert(entry.path().filename().string());
  for (const std::string& name : scripts) folders.erase(name);
  for (const std::string& folder : folders)
    for (const std::string& picture : comparableFiles(request.folder / "baselines" / folder)) {
      items.push_back(
          {.script = folder, .picture = picture, .baseline = request.folder / "baselines" / folder / picture});
      judge(items.back());
    }
  return items;
}

void prepareOutput(const fs::path& path) {
  OutputFolder folder(path);
  folder.requireOwn(kCheckResults);
  folder.startAnew(kCheckResults, [](const std::string& name) {
    return name == "actual" || name == "difference" || name == "wrong" || name == "live" || name == "index.html";
  });
}

}  // namespace

std::string verdictText(Verdict verdict) {
  constexpr std::array kTexts = {"ok",
                                 "differs",
                                 "another size",
                                 "no baseline",
                                 "no picture",
                                 "unreadable",
                                 "expected otherwise",
                                 "script failed",
                                 "wrong, not noticed",
                                 "wrong otherwise"};
  return kTexts[std::size_t(verdict)];
}

std::string CheckedItem::pictureText() const {
  if (picture.empty()) return "(script)";
  return controlLine == 0 ? picture : fmt::format("{}, wrong in line {}", picture, controlLine);
}

std::size_t CheckOutcome::failures() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(items, [](const CheckedItem& item) { return item.verdict != Verdict::passed; }));
}

bool CheckOutcome::scriptFailed() const {
  return std::ranges::find(items, Verdict::scriptFailed, &CheckedItem::verdict) != items.end();
}

CheckOutcome check(const Registry& registry, const Console& console, const CheckRequest& request) {
  const std::vector<std::string> scripts = scriptNames(request.folder);
  refuseUnknown(scripts, request.only);
  for (const char* own : {"out", "wrong", "here"})
    if (request.variables.contains(own)) throw Error(fmt::format("{}: this variable is set by check itself", own));
  prepareOutput(request.output);
  if (!request.junit.empty()) checkWritable(request.junit);
  CheckOutcome outcome;
  for (const std::string& name : scripts) {
    if (!request.only.empty() && std::ranges::find(request.only, name) == request.only.end()) continue;
    console.err << "hpsdf: checking " << name << std::endl;
    const auto start = Clock::now();
    auto items = ScriptCheck(request, name).run(registry, console);
    outcome.seconds[name] = std::chrono::duration<double>(Clock::now() - start).count();
    std::ranges::move(items, std::back_inserter(outcome.items));
  }
  if (request.only.empty()) std::ranges::move(strayBaselines(request, scripts), std::back_inserter(outcome.items));
  return outcome;
}

}  // namespace hpsdf::app
