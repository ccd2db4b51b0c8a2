#include "compare/compare_report.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "console/version.h"
#include "files/html_page.h"
#include "files/svg_chart.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/render/markup.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// A row of the table of figures.
struct FigureRow {
  const char* label;
  double (*value)(const FieldFigures&);
  std::string (*text)(double);
  bool isRatio = false;  ///< shows the figure divided by that of the first field
};

std::string countText(double number) { return grouped(std::uint64_t(number)); }
std::string percentText(double share) { return shortNumber(100 * share) + " %"; }
std::string nanosecondsText(double seconds) { return fmt::format("{:.1f} ns", 1e9 * seconds); }
std::string ratioText(double ratio) { return fmt::format("{:.2f}", ratio); }

using FF = const FieldFigures&;
const FigureRow kFigureRows[] = {
    {"memory", [](FF f) { return double(f.counts.bytes); }, bytesText},
    {"  over A", [](FF f) { return double(f.counts.bytes); }, ratioText, true},
    {"file", [](FF f) { return double(f.fileBytes); }, bytesText},
    {"leaves", [](FF f) { return double(f.counts.leaves); }, countText},
    {"  of these exact", [](FF f) { return double(f.counts.exact.leaves); }, countText},
    {"near the surface, RMS error", [](FF f) { return f.near.rms; }, shortNumber},
    {"  99 % of the errors within", [](FF f) { return f.near.percentiles.at(99); }, shortNumber},
    {"  greatest error", [](FF f) { return f.near.max; }, shortNumber},
    {"over the domain, RMS error", [](FF f) { return f.domain.rms; }, shortNumber},
    {"  99 % of the errors within", [](FF f) { return f.domain.percentiles.at(99); }, shortNumber},
    {"  greatest error", [](FF f) { return f.domain.max; }, shortNumber},
    {"points with the wrong sign", [](FF f) { return double(f.wrongSigns); }, countText},
    {"  farthest from the surface", [](FF f) { return f.farthestWrongSign; }, shortNumber},
    {"torn share of the surface", [](FF f) { return f.tornShare; }, percentText}};

const FigureRow kTimeRows[] = {{"time of a single query", [](FF f) { return f.times->single; }, nanosecondsText},
                               {"  over A", [](FF f) { return f.times->single; }, ratioText, true},
                               {"time of a query in a batch", [](FF f) { return f.times->batched; }, nanosecondsText},
                               {"  over A", [](FF f) { return f.times->batched; }, ratioText, true}};

std::vector<FigureRow> rowsOf(const FieldComparison& comparison) {
  std::vector<FigureRow> rows(std::begin(kFigureRows), std::end(kFigureRows));
  if (comparison.options.times) rows.insert(rows.end(), std::begin(kTimeRows), std::end(kTimeRows));
  return rows;
}

std::string cellText(const FigureRow& row, const FieldComparison& comparison, const FieldFigures& figures) {
  const double value = row.value(figures);
  if (!row.isRatio) return row.text(value);
  const double first = row.value(comparison.fields.front());
  return first > 0 ? row.text(value / first) : "–";
}

/// Returns a sentence about the points of the comparison.
std::string pointsText(const FieldComparison& comparison) {
  const CompareOptions& options = comparison.options;
  const std::string band =
      options.band > 0 ? fmt::format(" within {} of the surface", shortNumber(options.band)) : std::string();
  return fmt::format(
      "{} points, the same for all fields: half uniform in the domain{}, half within {} of points on the surface; seed "
      "{}. Lengths are in {}",
      grouped(options.points), band, shortNumber(options.near), options.seed, comparison.unit);
}

constexpr std::string_view kTimesNote =
    "Times are of one thread of this machine, at random points of the domain; the ratios were taken in one run.";

Json errorJson(const ErrorFigures& error) {
  return {
      {"points", error.samples}, {"rms", error.rms}, {"percentile_99", error.percentiles.at(99)}, {"max", error.max}};
}

Json timesJson(const FieldFigures& figures, const FieldFigures& first) {
  if (!figures.times) return {};
  const auto timeJson = [](double seconds, double ofFirst) {
    return Json{{"nanoseconds", 1e9 * seconds}, {"over_first", seconds / ofFirst}};
  };
  return {{"single", timeJson(figures.times->single, first.times->single)},
          {"batched", timeJson(figures.times->batched, first.times->batched)}};
}

Json figuresJson(const FieldFigures& figures, const FieldFigures& first) {
  Json bins = Json::array();
  for (const ErrorBin& bin : figures.bins)
    bins.push_back({{"from", bin.from}, {"to", bin.to}, {"points", bin.points}, {"rms", bin.rms}, {"max", bin.max}});
  return {{"letter", figures.letter},          {"field", figures.file},
          {"bytes", figures.counts.bytes},     {"file_bytes", figures.fileBytes},
          {"leaves", figures.counts.leaves},   {"exact_leaves", figures.counts.exact.leaves},
          {"near", errorJson(figures.near)},   {"domain", errorJson(figures.domain)},
          {"wrong_signs", figures.wrongSigns}, {"farthest_wrong_sign", figures.farthestWrongSign},
          {"torn_share", figures.tornShare},   {"query", timesJson(figures, first)},
          {"error_by_distance", bins}};
}

std::string worstText(const FieldComparison& comparison) {
  if (comparison.worst.empty()) return {};
  std::string text =
      fmt::format("\nworst places of each field, and the errors f − Φ of all fields there\n  {:<5} {:<36} {:>10}",
                  "worst", "at", "exact Φ");
  for (const FieldFigures& figures : comparison.fields) text += fmt::format(" {:>10}", figures.letter);
  text += "\n";
  for (const WorstPlace& place : comparison.worst) {
    text += fmt::format("  {:<5} {:<36} {:>10}", comparison.fields[place.field].letter,
                        vectorText(place.point, comparison.domain), shortNumber(place.exact));
    for (const double value : place.values) text += fmt::format(" {:>10}", shortNumber(value - place.exact));
    text += "\n";
  }
  return text;
}

constexpr std::string_view kCompareStyle = R"(
table.figures { width: auto; }
table.figures th, table.figures td { padding-right: 1.6rem; white-space: nowrap; overflow-wrap: normal; }
table.figures td { text-align: right; }
table.figures td.own { font-weight: 700; }
.wide-table { overflow-x: auto; }
.key { margin: .2rem 0; overflow-wrap: anywhere; }
.key i, th i { display: inline-block; width: .8em; height: .8em; margin-right: .45em; border-radius: 2px; }
.slider { max-width: 40rem; margin-left: auto; margin-right: auto; }
svg.chart { display: block; max-width: 100%; height: auto; }
.legend { margin: .2rem 0 .7rem; }
.legend svg { max-width: 100%; height: auto; }
)";

/// Returns a square in the colour of a field's curves.
std::string swatchHtml(std::size_t field) { return fmt::format("<i style=\"background:{}\"></i>", curveColor(field)); }

std::string nameOf(const FieldFigures& figures) {
  return fmt::format("{} {}", figures.letter, plainName(figures.file));
}

/// Returns the head of a table's columns for the fields, with their letters.
std::string letterCells(const FieldComparison& comparison) {
  std::string html;
  for (std::size_t n = 0; n < comparison.fields.size(); ++n)
    html += fmt::format("<th style=\"text-align:right\">{}{}</th>", swatchHtml(n), comparison.fields[n].letter);
  return html;
}

std::string figuresHtml(const FieldComparison& comparison) {
  std::string html;
  for (std::size_t n = 0; n < comparison.fields.size(); ++n)
    html += fmt::format("<p class=\"key\">{}{}&ensp;{}</p>\n", swatchHtml(n), comparison.fields[n].letter,
                        render::escapedMarkup(comparison.fields[n].file));
  html += "<div class=\"wide-table\"><table class=\"figures\">\n<tr><th></th>" + letterCells(comparison) + "</tr>\n";
  for (const FigureRow& row : rowsOf(comparison)) {
    const std::string label(row.label);
    html += fmt::format("<tr><th>{}{}</th>", label.starts_with(' ') ? "&emsp;" : "", render::escapedMarkup(label));
    for (const FieldFigures& figures : comparison.fields)
      html += fmt::format("<td>{}</td>", render::escapedMarkup(cellText(row, comparison, figures)));
    html += "</tr>\n";
  }
  html += "</table></div>\n<p>" + render::escapedMarkup(pointsText(comparison) + ".");
  if (comparison.options.times) html += " " + render::escapedMarkup(std::string(kTimesNote));
  return html + "</p>\n";
}

std::string curvesHtml(const FieldComparison& comparison) {
  Chart chart{.xLabel = fmt::format("distance from the surface |Φ| [{}]", comparison.unit),
              .yLabel = fmt::format("error |f − Φ| [{}]", comparison.unit),
              .solid = "RMS error",
              .dashed = "greatest error"};
  for (std::size_t n = 0; n < comparison.fields.size(); ++n) {
    const FieldFigures& figures = comparison.fields[n];
    ChartCurve rms{.name = nameOf(figures), .color = curveColor(n)}, greatest = rms;
    greatest.dashed = true;
    for (const ErrorBin& bin : figures.bins) {
      rms.points.push_back({bin.middle(), bin.rms});
      greatest.points.push_back({bin.middle(), bin.max});
    }
    chart.curves.push_back(std::move(rms));
    chart.curves.push_back(std::move(greatest));
  }
  return "<h2>Error over distance from the surface</h2>\n" + chartSvg(chart);
}

std::string viewHtml(const FieldComparison& comparison, const ComparedView& view) {
  std::vector<PagePicture> row;
  std::vector<std::string> names;
  for (std::size_t n = 0; n < comparison.fields.size(); ++n) {
    names.push_back(nameOf(comparison.fields[n]));
    row.push_back({names.back(), view.pngs[n]});
  }
  std::string html =
      fmt::format("<h2>{}</h2>\n<p>{}</p>\n", render::escapedMarkup(view.title),
                  render::escapedMarkup(view.caption + (view.showsLength ? ", in " + comparison.unit : "") + "."));
  if (!view.legend.empty()) html += fmt::format("<p class=\"legend\">{}</p>\n", view.legend);
  return html + pictureRow(row) + pictureSlider(names);
}

std::string worstHtml(const FieldComparison& comparison) {
  if (comparison.worst.empty()) return {};
  std::string html =
      "<h2>Worst places</h2>\n<p>The points with the greatest errors of each field, one of each cell, and the errors "
      "f − Φ of all fields there.</p>\n<div class=\"wide-table\"><table class=\"figures\">\n<tr><th>worst "
      "of</th><th>at</th>"
      "<th>exact Φ</th>" +
      letterCells(comparison) + "</tr>\n";
  for (const WorstPlace& place : comparison.worst) {
    html += fmt::format("<tr><th>{}{}</th><th>{}</th><td>{}</td>", swatchHtml(place.field),
                        comparison.fields[place.field].letter, vectorText(place.point, comparison.domain),
                        shortNumber(place.exact));
    for (std::size_t n = 0; n < place.values.size(); ++n)
      html += fmt::format("<td{}>{}</td>", n == place.field ? " class=\"own\"" : "",
                          shortNumber(place.values[n] - place.exact));
    html += "</tr>\n";
  }
  return html + "</table></div>\n";
}

}  // namespace

std::string comparisonText(const FieldComparison& comparison) {
  std::string text = fmt::format("{}\n{}\n", comparison.surface, pointsText(comparison));
  for (const FieldFigures& figures : comparison.fields) text += fmt::format("  {}  {}\n", figures.letter, figures.file);
  text += fmt::format("\n  {:<30}", "");
  for (const FieldFigures& figures : comparison.fields) text += fmt::format(" {:>11}", figures.letter);
  text += "\n";
  for (const FigureRow& row : rowsOf(comparison)) {
    text += fmt::format("  {:<30}", row.label);
    for (const FieldFigures& figures : comparison.fields)
      text += fmt::format(" {:>11}", cellText(row, comparison, figures));
    text += "\n";
  }
  if (comparison.options.times) text += fmt::format("{}\n", kTimesNote);
  return text + worstText(comparison);
}

Json comparisonJson(const FieldComparison& comparison) {
  Json fields = Json::array(), worst = Json::array();
  for (const FieldFigures& figures : comparison.fields)
    fields.push_back(figuresJson(figures, comparison.fields.front()));
  for (const WorstPlace& place : comparison.worst) {
    Json errors = Json::array();
    for (const double value : place.values) errors.push_back(value - place.exact);
    worst.push_back({{"field", comparison.fields[place.field].letter},
                     {"position", vectorJson(place.point)},
                     {"exact", place.exact},
                     {"errors", errors}});
  }
  const CompareOptions& options = comparison.options;
  return {{"mesh", comparison.surface},
          {"points", options.points},
          {"seed", options.seed},
          {"near", options.near},
          {"band", options.band},
          {"unit", comparison.unit},
          {"domain", boxJson(comparison.domain)},
          {"fields", fields},
          {"worst", worst}};
}

std::string comparisonHtml(const FieldComparison& comparison, const ComparedViews& views) {
  std::string html = htmlHead(fmt::format("{} fields of {}", comparison.fields.size(), plainName(comparison.surface)),
                              "Compared with the exact distance to " + comparison.surface,
                              std::string(kPictureRowStyle) + std::string(kCompareStyle));
  html += "<h2>Figures</h2>\n" + figuresHtml(comparison) + curvesHtml(comparison);
  for (const ComparedView& view : views.views) html += viewHtml(comparison, view);
  html += worstHtml(comparison);
  return html + std::string(kPictureRowScript) + htmlFoot(fmt::format("{}; {}", versionText(), views.renderer));
}

}  // namespace hpsdf::app
