// `study tradeoff`: bytes, time and errors of the fields of a mesh for a range of tolerances or of target errors.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <sstream>
#include <tuple>

#include "console/long_work.h"
#include "console/version.h"
#include "construction/build_arguments.h"
#include "construction/build_field.h"
#include "construction/surface.h"
#include "files/html_page.h"
#include "files/output_folder.h"
#include "files/svg_chart.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/render/markup.h"
#include "hpsdf/verify.h"
#include "session/field_summary.h"
#include "session/session.h"
#include "study/study_command.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// The option of `build` that ends the constructions of a range, and its values as a user writes them.
struct TradeoffRange {
  std::string option;
  std::vector<std::string> values;

  bool isOfTolerances() const { return option == "tolerance"; }
  const char* key() const { return isOfTolerances() ? "tolerance" : "target_error"; }
  const char* head() const { return isOfTolerances() ? "tolerance" : "τ"; }
  std::string named(const std::string& value) const {
    return fmt::format("{} {}", isOfTolerances() ? "tolerance" : "τ =", value);
  }
};

/// One field of the range.
struct TradeoffPoint {
  std::string end;      ///< value of the range's option
  std::string command;  ///< command line that builds the field
  FieldStatistics counts;
  double seconds;  ///< time to set up the exact distance and to build the field
  Measurement measured;
  bool isMissed;      ///< some cell or some point misses the tolerance
  double leastError;  ///< error at which the field equals the surface but for rounding
};

struct Tradeoff {
  std::string mesh, name;
  TradeoffRange range;
  std::vector<TradeoffPoint> points = {};
  std::string recommendation = {};              ///< "" if no limit was given
  std::optional<std::size_t> recommended = {};  ///< index of the recommended point

  const TradeoffPoint* best() const { return recommended ? &points[*recommended] : nullptr; }
};

/// Returns a number as a user would write it: 1e-6, or with all its digits where three do not suffice.
std::string exactText(double number) {
  const std::string text = shortNumber(number);
  return parseNumber(text) == number ? text : fmt::format("{}", number);
}

/// Returns the parts of a text between commas.
std::vector<std::string> partsOf(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  return parts;
}

/// Returns the range of tolerances in their given order.
TradeoffRange rangeOfTolerances(const std::string& text) {
  constexpr std::size_t kMost = 20;
  const auto isTolerance = [](std::string value) {
    if (value.ends_with('%')) value.pop_back();
    const auto number = parseNumber(value);
    return number && *number > 0;
  };
  TradeoffRange range{"tolerance", partsOf(text)};
  if (range.values.empty() || range.values.size() > kMost || !std::ranges::all_of(range.values, isTolerance))
    throw Error(
        fmt::format("tolerances: expected 1 to {} lengths or percentages with commas between them, such as "
                    "1%,0.5%, found '{}'",
                    kMost, text));
  return range;
}

/// Returns the range of target errors, the greatest first, or else that of tolerances.
TradeoffRange rangeOf(const Arguments& arguments) {
  if (!arguments.has("target-errors")) return rangeOfTolerances(arguments.text("tolerances"));
  if (arguments.given("tolerances")) throw Error("tolerances and target-errors are two ranges: leave out one of them");
  std::vector<double> targets = arguments.numbers("target-errors");
  std::ranges::sort(targets, std::greater());
  targets.erase(std::unique(targets.begin(), targets.end()), targets.end());
  TradeoffRange range{"target-error", {}};
  for (const double target : targets) range.values.push_back(exactText(target));
  return range;
}

/// Returns the arguments of `build` for one point of the range.
Arguments pointArguments(const Session& session, const Arguments& arguments, std::size_t mesh,
                         const TradeoffRange& range, const std::string& value) {
  return buildArguments(session, arguments, mesh, {fmt::format("--{}={}", range.option, value)});
}

TradeoffPoint tradeoffPoint(const Console& console, const BuildInput& input, const Arguments& buildArguments,
                            const Arguments& arguments, const std::string& end) {
  const auto start = std::chrono::steady_clock::now();
  const BuildOptions options = buildOptions(buildArguments, input.exact->source().box.sizes().maxCoeff());
  return withProgress(console, [&](const Progress& progress) {
    Field field = withinMemory(buildArguments, [&] { return build(*input.exact, input.domain, options, progress); });
    const double seconds = input.setUpSeconds + secondsSince(start);
    const MeasureOptions measuring{.points = static_cast<std::size_t>(arguments.number("points")),
                                   .seed = static_cast<std::uint64_t>(arguments.number("seed")),
                                   .threads = options.threads};
    const Measurement measured = measure(field, *input.exact, measuring, progress);
    field = withMeasurement(std::move(field), measured);
    return TradeoffPoint{.end = end,
                         .command = {},
                         .counts = statistics(field),
                         .seconds = seconds,
                         .measured = measured,
                         .isMissed = missesTolerance(field),
                         .leastError = 1e-6 * field.metadata().referenceLength};
  });
}

/// Orders fields by exactness: by the RMS error near the surface, and by that over the domain where both fields equal
/// the surface but for rounding.
auto inexactness(const TradeoffPoint& point) {
  return std::tuple(std::max(point.measured.near.rms, point.leastError), point.measured.domain.rms, point.counts.bytes);
}

/// Chooses the most exact field of the range that keeps the limits of the arguments, and says so in a sentence.
void recommend(Tradeoff& tradeoff, const Arguments& arguments) {
  const bool hasBudget = arguments.has("budget"), hasTime = arguments.has("within-seconds");
  if (!hasBudget && !hasTime) return;
  const auto keepsLimits = [&](const TradeoffPoint& point) {
    return (!hasBudget || double(point.counts.bytes) <= arguments.number("budget")) &&
           (!hasTime || point.seconds <= arguments.number("within-seconds"));
  };
  for (std::size_t n = 0; n < tradeoff.points.size(); ++n) {
    const TradeoffPoint* best = tradeoff.best();
    if (keepsLimits(tradeoff.points[n]) && (best == nullptr || inexactness(tradeoff.points[n]) < inexactness(*best)))
      tradeoff.recommended = n;
  }
  const std::string limits =
      fmt::format("{}{}{}", hasBudget ? bytesText(arguments.number("budget")) : "", hasBudget && hasTime ? " and " : "",
                  hasTime ? fmt::format("{} s", shortNumber(arguments.number("within-seconds"))) : "");
  if (const TradeoffPoint* best = tradeoff.best()) {
    tradeoff.recommendation = fmt::format(
        "Within {}, the most exact field of the range is that of {}: it takes {} and {} s, and its RMS error is {} "
        "near "
        "the surface and {} over the domain.",
        limits, tradeoff.range.named(best->end), bytesText(double(best->counts.bytes)), shortNumber(best->seconds),
        shortNumber(best->measured.near.rms), shortNumber(best->measured.domain.rms));
    return;
  }
  const TradeoffPoint& smallest =
      *std::ranges::min_element(tradeoff.points, {}, [](const TradeoffPoint& point) { return point.counts.bytes; });
  tradeoff.recommendation = fmt::format(
      "No field of the range keeps within {}: the smallest, that of {}, takes {} and {} s. Give greater {} or wider "
      "limits.",
      limits, tradeoff.range.named(smallest.end), bytesText(double(smallest.counts.bytes)),
      shortNumber(smallest.seconds), tradeoff.range.isOfTolerances() ? "tolerances" : "target errors");
}

Tradeoff tradeoffOf(Session& session, const Arguments& arguments, std::size_t mesh, const std::string& name) {
  Tradeoff tradeoff{arguments.texts("mesh")[mesh], name, rangeOf(arguments)};
  Console console = session.console();
  const TradeoffRange& range = tradeoff.range;
  const Arguments first = pointArguments(session, arguments, mesh, range, range.values.front());
  if (const std::string idle = givenWithoutEffectWithinTolerance(first); range.isOfTolerances() && !idle.empty())
    throw Error(fmt::format("{0} has no effect within a tolerance: leave out {0}, or give target-errors", idle));
  const BuildInput input = buildInput(console, tradeoff.mesh, first);
  for (const std::string& value : range.values) {
    const Arguments point = pointArguments(session, arguments, mesh, range, value);
    console.work = fmt::format("{} of {}, {}: ", tradeoff.points.size() + 1, range.values.size(), range.named(value));
    tradeoff.points.push_back(
        namingSurface(tradeoff.mesh, [&] { return tradeoffPoint(console, input, point, arguments, value); }));
    tradeoff.points.back().command = buildCommandLine(tradeoff.mesh, name + ".hpsdf", point);
  }
  recommend(tradeoff, arguments);
  return tradeoff;
}

Json endJson(const TradeoffRange& range, const TradeoffPoint& point) {
  return range.isOfTolerances() ? Json(point.end) : Json(*parseNumber(point.end));
}

Json pointJson(const TradeoffRange& range, const TradeoffPoint& point) {
  const Measurement& m = point.measured;
  Json json = {{range.key(), endJson(range, point)},
               {"bytes", point.counts.bytes},
               {"leaves", point.counts.leaves},
               {"exact_leaves", point.counts.exact.leaves},
               {"seconds", point.seconds},
               {"near_rms", m.near.rms},
               {"near_max", m.near.max},
               {"domain_rms", m.domain.rms},
               {"domain_max", m.domain.max},
               {"wrong_signs", m.wrongSigns},
               {"torn_share", m.tornShare}};
  if (range.isOfTolerances()) {
    json["tolerance_ratio"] = m.toleranceRatio;
    json["kept"] = !point.isMissed;
  }
  return json;
}

Json tradeoffJson(const Tradeoff& tradeoff) {
  Json points = Json::array();
  for (const TradeoffPoint& point : tradeoff.points) points.push_back(pointJson(tradeoff.range, point));
  Json json = {{"mesh", tradeoff.mesh}, {"name", tradeoff.name}, {"points", points}, {"recommended", Json()}};
  if (const TradeoffPoint* best = tradeoff.best())
    json["recommended"] = {{tradeoff.range.key(), endJson(tradeoff.range, *best)}, {"command", best->command}};
  return json;
}

std::string tradeoffCsv(const std::vector<Tradeoff>& tradeoffs) {
  std::string text = fmt::format(
      "mesh,{},bytes,leaves,exact_leaves,seconds,near_rms,near_max,domain_rms,domain_max,wrong_signs,"
      "torn_share{}\n",
      tradeoffs.front().range.key(), tradeoffs.front().range.isOfTolerances() ? ",tolerance_ratio,kept" : "");
  for (const Tradeoff& tradeoff : tradeoffs)
    for (const TradeoffPoint& point : tradeoff.points)
      text += fmt::format("{},{}\n", tradeoff.name, rowText(pointJson(tradeoff.range, point)));
  return text;
}

/// Returns the figures of a point as text, in the order of `tradeoffHeads`.
std::vector<std::string> tradeoffCells(const TradeoffRange& range, const TradeoffPoint& point) {
  const Measurement& m = point.measured;
  std::vector<std::string> cells = {point.end,
                                    bytesText(double(point.counts.bytes)),
                                    grouped(point.counts.leaves),
                                    shortNumber(point.seconds) + " s",
                                    shortNumber(m.near.rms),
                                    shortNumber(m.near.max),
                                    shortNumber(m.domain.rms),
                                    shortNumber(m.domain.max),
                                    shortNumber(100 * m.tornShare) + " %"};
  if (range.isOfTolerances()) cells.push_back(point.isMissed ? "no" : "yes");
  return cells;
}

std::vector<std::string> tradeoffHeads(const TradeoffRange& range) {
  std::vector<std::string> heads = {range.head(), "memory",     "leaves",     "time", "near RMS",
                                    "near max",   "domain RMS", "domain max", "torn"};
  if (range.isOfTolerances()) heads.push_back("kept");
  return heads;
}

std::string tradeoffText(const Tradeoff& tradeoff) {
  std::string text = tradeoff.mesh + "\n ";
  for (const std::string& head : tradeoffHeads(tradeoff.range)) text += fmt::format(" {:>11}", head);
  text += "\n";
  for (const TradeoffPoint& point : tradeoff.points) {
    text += " ";
    for (const std::string& cell : tradeoffCells(tradeoff.range, point)) text += fmt::format(" {:>11}", cell);
    text += "\n";
  }
  if (tradeoff.recommendation.empty()) return text;
  text += tradeoff.recommendation + "\n";
  return tradeoff.recommended ? text + "  " + tradeoff.best()->command + "\n" : text;
}

/// Returns the chart of the errors over a cost, such as bytes.
Chart tradeoffChart(const Tradeoff& tradeoff, const std::string& costLabel, double (*cost)(const TradeoffPoint&)) {
  using Error = Measurement::Error;
  const std::pair<const char*, Error Measurement::*> kinds[] = {{"near the surface", &Measurement::near},
                                                                {"over the domain", &Measurement::domain}};
  Chart chart{
      .xLabel = costLabel, .yLabel = "error [units of the field]", .solid = "RMS error", .dashed = "greatest error"};
  for (std::size_t n = 0; n < std::size(kinds); ++n) {
    ChartCurve rms{.name = kinds[n].first, .color = curveColor(n)}, greatest = rms;
    greatest.dashed = true;
    for (const TradeoffPoint& point : tradeoff.points) {
      const Error& error = point.measured.*kinds[n].second;
      rms.points.push_back({cost(point), error.rms});
      greatest.points.push_back({cost(point), error.max});
    }
    for (ChartCurve* curve : {&rms, &greatest}) {
      std::ranges::sort(curve->points);
      chart.curves.push_back(std::move(*curve));
    }
  }
  return chart;
}

Chart memoryChart(const Tradeoff& tradeoff) {
  return tradeoffChart(tradeoff, "memory [bytes]", [](const TradeoffPoint& p) { return double(p.counts.bytes); });
}

Chart timeChart(const Tradeoff& tradeoff) {
  return tradeoffChart(tradeoff, "time of the construction [s]", [](const TradeoffPoint& p) { return p.seconds; });
}

constexpr std::string_view kTradeoffStyle = R"(
table { width: auto; }
td, th { padding-right: 1.8rem; text-align: right; white-space: nowrap; }
tr.chosen td { font-weight: 700; }
svg.chart { display: block; max-width: 100%; height: auto; margin: 1rem 0; }
)";

std::string tradeoffSection(const Tradeoff& tradeoff) {
  std::string html = fmt::format("<h2>{}</h2>\n<table>\n<tr>", render::escapedMarkup(tradeoff.mesh));
  for (const std::string& head : tradeoffHeads(tradeoff.range)) html += fmt::format("<th>{}</th>", head);
  html += "</tr>\n";
  for (const TradeoffPoint& point : tradeoff.points) {
    html += &point == tradeoff.best() ? "<tr class=\"chosen\">" : "<tr>";
    for (const std::string& cell : tradeoffCells(tradeoff.range, point))
      html += fmt::format("<td>{}</td>", render::escapedMarkup(cell));
    html += "</tr>\n";
  }
  html += "</table>\n";
  html += fmt::format(
      "<p>Errors are measured at random points, half of them within {} of the surface, and are in the units of the "
      "field. Time is that of the construction on this machine.{}</p>\n",
      shortNumber(tradeoff.points.front().measured.nearDistance),
      tradeoff.range.isOfTolerances() ? " A tolerance is kept if no cell and no point misses it." : "");
  if (!tradeoff.recommendation.empty())
    html += fmt::format("<p>{}</p>\n", render::escapedMarkup(tradeoff.recommendation));
  if (tradeoff.recommended) html += fmt::format("<code>{}</code>\n", render::escapedMarkup(tradeoff.best()->command));
  return html + chartSvg(memoryChart(tradeoff)) + chartSvg(timeChart(tradeoff));
}

std::string tradeoffHtml(const std::vector<Tradeoff>& tradeoffs) {
  std::string html = htmlHead("Size, time and accuracy",
                              fmt::format("Fields of the same mesh for a range of {}",
                                          tradeoffs.front().range.isOfTolerances() ? "tolerances" : "target errors τ"),
                              kTradeoffStyle);
  for (const Tradeoff& tradeoff : tradeoffs) html += tradeoffSection(tradeoff);
  return html + htmlFoot(versionText());
}

void runTradeoff(Session& session, const Arguments& arguments) {
  OutputFolder folder(arguments.text("output"));
  checkWritable(folder.path() / "index.html");
  const std::vector<std::string> names = checkedNames(session, arguments);
  std::vector<Tradeoff> tradeoffs;
  tradeoffs.reserve(names.size());
  for (std::size_t n = 0; n < names.size(); ++n) tradeoffs.push_back(tradeoffOf(session, arguments, n, names[n]));

  Json json = {{"points", static_cast<std::uint64_t>(arguments.number("points"))},
               {"seed", static_cast<std::uint64_t>(arguments.number("seed"))},
               {"meshes", Json::array()}};
  for (const Tradeoff& tradeoff : tradeoffs) json["meshes"].push_back(tradeoffJson(tradeoff));
  const InterruptGuard guard;  // on Ctrl-C, all files are written or none
  folder.write("tradeoff.csv", tradeoffCsv(tradeoffs));
  folder.write("tradeoff.json", jsonText(json));
  folder.write("index.html", tradeoffHtml(tradeoffs));
  for (std::size_t n = 0; n < tradeoffs.size(); ++n) {
    writeChart(folder, names[n] + "-memory", memoryChart(tradeoffs[n]));
    writeChart(folder, names[n] + "-time", timeChart(tradeoffs[n]));
  }
  folder.commit();
  json["page"] = (folder.path() / "index.html").string();
  if (session.wantsJson(arguments)) return printJson(session.console().out, json);
  for (const Tradeoff& tradeoff : tradeoffs) session.console().out << tradeoffText(tradeoff);
  session.console().out << json["page"].get<std::string>() << "\n";
}

/// Returns the parameters of `build` except those that the range replaces: whatever else ends a construction.
std::vector<Parameter> rangeBuildParameters() {
  using Ending = BuildSetting::Ending;
  std::vector<std::string> left = endParametersAndTheirs(
      {Ending::target, Ending::byDistance, Ending::tolerance, Ending::otherQuantity, Ending::steps});
  return buildParametersWithout(left);
}

std::vector<std::size_t> countsFrom(std::size_t least, std::size_t most) {
  std::vector<std::size_t> counts;
  for (std::size_t count = least; count <= most; ++count) counts.push_back(count);
  return counts;
}

}  // namespace

Study tradeoffStudy() {
  return {
      .name = "tradeoff",
      .help = paragraphs(R"(
bytes, time and measured errors of a mesh's fields for a range of tolerances, or of target errors. Use it to choose the
--tolerance, or the --target-error, of 'hpsdf build' for a mesh. With --budget or --within-seconds it names the most exact field of the range that keeps them, and
the command that builds it; the field with the least RMS error near the surface is the most exact. The column "kept" says
whether a tolerance was kept by all cells and at all points. Half of the points at
which errors are measured lie near the surface. Writes index.html with the table and the curves, tradeoff.csv, tradeoff.json,
and the curves of each mesh for papers: NAME-memory and NAME-time as .svg and .pdf.)"),
      .parameters = joined(
          {{{"tolerances", text("TOLERANCE,…").byDefault("2%,1%,0.5%,0.2%,0.1%"),
             "The tolerances of the range, as lengths or as percentages of the mesh's longest side. Each makes a field "
             "of its own, so that the smallest one takes most of the time."},
            {"target-errors", numbers("τ,τ,…", countsFrom(1, 20)).above(0),
             "A range of target errors τ in place of tolerances, such as 1e-4,1e-5,1e-6."},
            {"budget", number().above(0).in("bytes"),
             "Recommends the most exact field that takes at most this memory. To build for a budget without a study, "
             "use 'build --max-bytes'."},
            {"within-seconds", number().above(0).in("seconds"),
             "Recommends the most exact field whose construction takes at most this time on this machine."}},
           samplingParameters(),
           rangeBuildParameters()}),
      .run = runTradeoff,
  };
}

}  // namespace hpsdf::app
