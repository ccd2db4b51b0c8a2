#include "check/check_command.h"

#include <fmt/format.h>

#include <algorithm>

#include "check/baseline.h"
#include "check/check.h"
#include "console/version.h"
#include "files/data_table.h"
#include "files/text_file.h"
#include "hpsdf/app/failed.h"
#include "hpsdf/detail/nearest_name.h"
#include "hpsdf/render/image.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

/// Returns the canonical path of a folder. The command `accept` compares it with the folder of the last check.
std::string folderId(const fs::path& folder) { return fs::weakly_canonical(folder).string(); }

// The implementation of the command `check`.

Json itemJson(const CheckedItem& item, const fs::path& output) {
  return {{"script", item.script},
          {"picture", item.picture},
          {"control_line", item.controlLine == 0 ? Json() : Json(item.controlLine)},
          {"result", verdictText(item.verdict)},
          {"passed", item.verdict == Verdict::passed},
          {"problem", item.problem},
          {"compared", item.compared},
          {"differing", item.differing},
          {"largest_difference", item.largest},
          {"budget", item.budget},
          {"renderer", item.renderer},
          {"baseline_renderer", item.baselineRenderer},
          {"written_by", item.where},
          {"live", item.live.empty() ? Json() : Json((output / item.live).string())}};
}

Json outcomeJson(const CheckOutcome& outcome, const CheckRequest& request) {
  Json items = Json::array();
  for (const CheckedItem& item : outcome.items) items.push_back(itemJson(item, request.output));
  return {{"folder", folderId(request.folder)},
          {"page", (request.output / "index.html").string()},
          {"version", versionText()},
          {"failures", outcome.failures()},
          {"items", items}};
}

std::string tableText(const CheckOutcome& outcome) {
  std::size_t script = 6, picture = 7;
  for (const CheckedItem& item : outcome.items) {
    script = std::max(script, item.script.size());
    picture = std::max(picture, item.pictureText().size());
  }
  const auto row = [&](const std::string& a, const std::string& b, const std::string& c, const std::string& d,
                       const std::string& e) {
    return fmt::format("{:<{}}  {:<{}}  {:<18}  {:>10}  {:>8}\n", a, script, b, picture, c, d, e);
  };
  std::string text = row("script", "picture", "result", "differing", "largest");
  for (const CheckedItem& item : outcome.items)
    text += row(item.script, item.pictureText(), verdictText(item.verdict), grouped(item.differing),
                fmt::format("{:.3g}", item.largest));
  for (const CheckedItem& item : outcome.items)
    if (item.verdict != Verdict::passed) text += fmt::format("{}: {}\n", item.title(), item.problem);
  return text;
}

void refuseInScripts(const Session& session, const char* verb) {
  if (session.scriptDepth > 0) throw Error(fmt::format("{}: is for the command line; a script cannot run it", verb));
}

void runCheck(Session& session, const Arguments& arguments) {
  refuseInScripts(session, "check");
  const CheckRequest request{.folder = arguments.text("folder"),
                             .output = arguments.text("out"),
                             .only = arguments.texts("only"),
                             .variables = parseVariables(arguments.texts("variables")),
                             .junit = arguments.given("junit") ? arguments.text("junit") : ""};
  const CheckOutcome outcome = check(session.registry(), session.console(), request);
  const Json json = outcomeJson(outcome, request);
  const fs::path page = request.output / "index.html";
  writeTextFile(page, checkHtml(outcome, request));
  if (!request.junit.empty()) writeTextFile(request.junit, junitXml(outcome));
  writeTextFile(request.output / kCheckResults, jsonText(json));
  std::ostream& out = session.console().out;
  if (session.wantsJson(arguments))
    printJson(out, json);
  else
    out << tableText(outcome) << page.string() << "\n";
  if (outcome.failures() == 0) return;
  const std::string summary = fmt::format("{} of {} comparisons failed; {} shows them", outcome.failures(),
                                          outcome.items.size(), page.string());
  if (outcome.scriptFailed()) throw Error(summary);
  throw Failed(summary);
}

// The implementation of the command `accept`.

Json lastResults(const fs::path& folder, const fs::path& from) {
  const std::string file = (from / kCheckResults).string();
  const std::string again = fmt::format("run 'hpsdf check {}' first", shellWord(folder.string()));
  if (!fs::exists(file)) throw Error(fmt::format("{}: no such file; {}, or name its folder with --from", file, again));
  Json json = Json::parse(readTextFile(file), nullptr, false);
  if (!json.is_object() || !json.contains("items"))
    throw Error(fmt::format("{}: is not the result of a whole check; {}", file, again));
  if (json.value("folder", "") != folderId(folder))
    throw Error(fmt::format("{}: is the result of a check of {}; {}", file, json.value("folder", ""), again));
  return json;
}

std::string nameOf(const Json& item) {
  return item.at("script").get<std::string>() + "/" + item.at("picture").get<std::string>();
}

/// Returns the last check's result for the picture `name`, which has the form SCRIPT/PICTURE. Ignores pictures that are
/// wrong on purpose. Throws `Error` if no result has this name.
Json resultNamed(const std::string& name, const Json& results, const fs::path& from) {
  std::vector<std::string> names;
  for (const Json& item : results.at("items")) {
    if (!item.at("control_line").is_null() || !fs::is_regular_file(from / "actual" / nameOf(item))) continue;
    names.push_back(nameOf(item));
    if (names.back() == name) return item;
  }
  throw Error(fmt::format("the last check wrote no picture '{}'; {}", name,
                          didYouMean(name, names, "expected SCRIPT/PICTURE.png")));
}

std::array<std::size_t, 2> sizeOf(const fs::path& file) {
  if (isDataFile(file)) {
    const DataTable table = loadData(file);
    return {table.columns, table.rows};
  }
  const render::Image image = render::loadPng(file);
  return {std::size_t(image.width), std::size_t(image.height)};
}

Json acceptOne(const Json& item, const fs::path& folder, const fs::path& from, const Arguments& arguments) {
  const fs::path actual = from / "actual" / nameOf(item), baseline = folder / "baselines" / nameOf(item);
  std::optional<BaselineFacts> older;  // empty if there is no baseline yet, or no JSON file beside it
  if (fs::exists(baseline) && fs::exists(factsFile(baseline))) older = loadFacts(baseline);
  BaselineFacts facts = older.value_or(BaselineFacts{});
  facts.size = sizeOf(actual);
  facts.renderer = item.at("renderer");
  facts.version = versionText();
  if (arguments.given("budget")) facts.budget = arguments.number("budget");
  if (arguments.given("bound")) facts.bound = arguments.number("bound");
  fs::create_directories(baseline.parent_path());
  writeTextFile(baseline, readWholeFile(actual.string()));
  saveFacts(facts, baseline);
  return {{"name", nameOf(item)},
          {"baseline", baseline.string()},
          {"renderer", facts.renderer},
          {"renderer_before", older ? Json(older->renderer) : Json()}};
}

std::string acceptedText(const Json& accepted) {
  const Json& before = accepted.at("renderer_before");
  const auto shown = [](const std::string& renderer) { return renderer.empty() ? "none" : renderer; };
  return fmt::format("{}\n  renderer now     {}\n  renderer before  {}\n", accepted.at("baseline").get<std::string>(),
                     shown(accepted.at("renderer")),
                     before.is_null() ? "none: a new baseline" : shown(before.get<std::string>()));
}

void runAccept(Session& session, const Arguments& arguments) {
  refuseInScripts(session, "accept");
  const fs::path folder = arguments.text("folder");
  const fs::path from = arguments.text("from");
  const Json results = lastResults(folder, from);
  std::vector<Json> taken;  // results to accept; all names are checked before any file is written
  for (const std::string& name : arguments.texts("names")) taken.push_back(resultNamed(name, results, from));
  Json accepted = Json::array();
  for (const Json& item : taken) accepted.push_back(acceptOne(item, folder, from, arguments));
  if (session.wantsJson(arguments)) return printJson(session.console().out, accepted);
  for (const Json& one : accepted) session.console().out << acceptedText(one);
}

const Parameter kFolder = {"folder", file("FOLDER").positional().required(),
                           "Folder that holds scripts/NAME.hps and baselines/NAME/PICTURE.png."};

}  // namespace

void addCheckCommands(Registry& registry) {
  registry.add({
      .name = "check",
      .summary = "Run a folder's scripts and compare their pictures with its baselines.",
      .help = paragraphs(R"(
Each script of FOLDER/scripts runs in a session of its own and writes pictures (.png) and raw values (.csv, .pfm) into
$out. Each result is compared with its baseline in FOLDER/baselines/SCRIPT. A check fails where sizes differ, too many
pixels differ, a baseline is missing or no script writes it, a script fails, or a picture that must be rejected passes.

The output folder receives all results, the differences, and one page that shows the failures and can be mailed.
docs/check.md is the manual.

Exit status: 0 nothing failed, 1 a comparison failed, 2 a script failed or bad input.)"),
      .examples = {"hpsdf check screenshots mesh=bunny.obj",
                   "hpsdf check pictures --only gallery --out /tmp/check --junit check.xml"},
      .parameters = {kFolder,
                     {"variables", text("name=value").positional().repeatable(), "Variables of the scripts."},
                     {"out", outputFile("FOLDER").byDefault("check-results"),
                      "Folder of the results. Those of an earlier check are removed."},
                     {"only", text("SCRIPT").repeatable(),
                      "Runs this script instead of all: the name of its file without .hps."},
                     {"junit", outputFile(), "Writes the results as JUnit XML, for continuous integration."}},
      .action = runCheck,
      .takesVariables = true,
  });
  registry.add({
      .name = "accept",
      .summary = "Accept pictures of the last check as new baselines, one by one.",
      .help =
          "Each NAME is SCRIPT/PICTURE.png as in the table of the check. The picture and a small JSON file with size, "
          "renderer and version are copied to FOLDER/baselines/SCRIPT. View the pictures first.",
      .examples = {"hpsdf accept screenshots gallery/degree.png",
                   "hpsdf accept pictures lines/cracks.png --from /tmp/check --budget 0.005"},
      .parameters =
          {kFolder,
           {"names", text("SCRIPT/PICTURE").positional().repeatable().required(), "Pictures to accept."},
           {"from", file("FOLDER").byDefault("check-results"), "Folder of the check's results."},
           {"budget", number().within(0, 1),
            "Share of the pixels or values that may differ in future checks. When left out, that of the older "
            "baseline, or 0.002."},
           {"bound", number().atLeast(0),
            "Difference of raw values that future checks accept. When left out, that of the older baseline, or 1e-6."}},
      .action = runAccept,
  });
}

}  // namespace hpsdf::app
