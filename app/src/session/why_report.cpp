#include "session/why_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "console/long_work.h"
#include "construction/mesh_summary.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/sign_check.h"
#include "session/field_surface.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

const char* featureName(Feature feature) {
  if (feature == Feature::vertex) return "vertex";
  return feature == Feature::edge ? "edge" : "face";
}

const char* stageName(CellStage stage) {
  switch (stage) {
    case CellStage::exactLeaves:
      return "exact leaves";
    case CellStage::refinement:
      return "refinement";
    case CellStage::maxError:
      return "max-error";
    case CellStage::pruning:
      return "pruning";
    case CellStage::enrichment:
      return "enrich";
    case CellStage::tolerance:
      return "tolerance";
  }
  return "";
}

const char* choiceName(CellChoice choice) {
  if (choice == CellChoice::raise) return "raised";
  return choice == CellChoice::divide ? "divided" : "kept";
}

Json optionalJson(const std::optional<double>& number) { return number ? Json(*number) : Json(); }

Json alternativeJson(const std::optional<CellAlternative>& alternative) {
  if (!alternative) return {};
  return {{"bytes", alternative->bytes},
          {"error", alternative->error},
          {"gain", optionalJson(alternative->gain)},
          {"rejected", alternative->isRejected},
          {"unproven", alternative->isUnproven}};
}

Json stepJson(const CellStep& step) {
  return {{"stage", stageName(step.stage)},
          {"depth", step.depth},
          {"degree", step.degree ? degreeJson(*step.degree) : Json()},
          {"box", boxJson(step.box)},
          {"estimated_rms", optionalJson(step.estimatedRms)},
          {"measured_rms", optionalJson(step.measuredRms)},
          {"measured_max", optionalJson(step.measuredMax)},
          {"weighted_error", step.weighted},
          {"trial_degree", step.trialDegree ? Json(*step.trialDegree) : Json()},
          {"degree_trial", alternativeJson(step.degreeTrial)},
          {"octree_trial", alternativeJson(step.octreeTrial)},
          {"exact_trial", alternativeJson(step.exactTrial)},
          {"triangles", step.triangles},
          {"list_is_too_long", step.listIsTooLong},
          {"choice", choiceName(step.choice)}};
}

std::size_t countOfChoice(const CellHistory& history, CellChoice choice) {
  return static_cast<std::size_t>(std::ranges::count(history.steps, choice, &CellStep::choice));
}

bool isWithinTolerance(const WhyReport& report) { return report.field.metadata().settings.tolerance > 0; }

/// A number of a column, or a dash where there is none.
std::string numberOrDash(const std::optional<double>& number) { return number ? shortNumber(*number) : "–"; }

std::string exactColumn(const CellStep& step) {
  if (step.exactTrial || (step.degree && *step.degree == kExactDegree)) return grouped(step.triangles);
  return step.listIsTooLong ? "too many" : "–";
}

/// Returns the rows of a table with aligned columns, two blanks apart.
std::string alignedRows(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  const auto width = [](const std::string& text) {  // in characters: all but the later bytes of UTF-8
    return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xc0) != 0x80; }));
  };
  for (const auto& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (widths.size() <= i) widths.push_back(0);
      widths[i] = std::max(widths[i], width(row[i]));
    }
  std::string text;
  for (const auto& row : rows) {
    std::string line = " ";
    for (std::size_t i = 0; i < row.size(); ++i)
      line += " " + (i + 1 < row.size() ? std::string(widths[i] - width(row[i]), ' ') + row[i] + " " : row[i]);
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

std::string refinementTable(const CellHistory& history) {
  std::vector<std::vector<std::string>> rows = {{"depth", "degree", "estimated RMS", "measured RMS", "greatest",
                                                 "gain of degree, μ", "of 8 children, ν", "exact list", ""}};
  for (const CellStep& step : history.steps) {
    const auto gain = [](const std::optional<CellAlternative>& trial) { return trial ? trial->gain : std::nullopt; };
    rows.push_back({fmt::format("{}", step.depth), step.degree ? levelName(*step.degree) : "–",
                    numberOrDash(step.estimatedRms), numberOrDash(step.measuredRms), numberOrDash(step.measuredMax),
                    numberOrDash(gain(step.degreeTrial)), numberOrDash(gain(step.octreeTrial)), exactColumn(step),
                    fmt::format("{}{}", choiceName(step.choice),
                                step.stage == CellStage::refinement || step.stage == CellStage::exactLeaves
                                    ? ""
                                    : fmt::format(" ({})", stageName(step.stage)))});
  }
  return alignedRows(rows);
}

/// Returns the error of a polynomial over the allowed one, and whether the polynomial was rejected for it.
std::string polynomialErrorColumn(const CellStep& step) {
  if (!step.degreeTrial) return "–";
  const char* rejected = step.degreeTrial->isUnproven ? ", no proof" : ", rejected";
  return shortNumber(step.degreeTrial->error) + (step.degreeTrial->isRejected ? rejected : "");
}

std::string toleranceTable(const CellHistory& history) {
  std::vector<std::vector<std::string>> rows = {
      {"depth", "edge", "polynomial", "error / allowed", "its bytes", "list", "its bytes", "bytes of 8 children", ""}};
  for (const CellStep& step : history.steps) {
    const auto bytes = [](const std::optional<CellAlternative>& trial) {
      return trial ? grouped(static_cast<std::uint64_t>(trial->bytes)) : "–";
    };
    const bool isBound = step.choice == CellChoice::keep && step.octreeTrial;
    rows.push_back({fmt::format("{}", step.depth), shortNumber(step.box.sizes().maxCoeff()),
                    step.trialDegree ? fmt::format("degree {}", *step.trialDegree) : "–", polynomialErrorColumn(step),
                    bytes(step.degreeTrial), exactColumn(step), bytes(step.exactTrial),
                    (isBound ? "≥ " : "") + bytes(step.octreeTrial), choiceName(step.choice)});
  }
  return alignedRows(rows);
}

/// Returns a winding number as text, without the rounding errors of its sum.
std::string windingText(double number) {
  constexpr double kRounding = 1e-6;
  const double whole = std::round(number);
  return fmt::format("{:.4g}", (std::abs(number - whole) < kRounding ? whole : number) + 0.0);
}

std::string signText(const WhyReport& report) {
  const Source& source = report.field.metadata().source;
  constexpr double kOnSurface = 1e-9;  // of the surface's size: what rounding leaves of a distance of 0
  if (std::abs(report.exact) <= kOnSurface * report.field.metadata().referenceLength) return "on the surface";
  std::string text = report.exact < 0 ? "inside" : "outside";
  if (source.faces > 0) text += fmt::format(", by {}", insideTestName(source.insideTest));
  if (report.windingNumber) text += "; winding number " + windingText(*report.windingNumber);
  if ((report.value < 0) != (report.exact < 0)) text += "; the field has the other sign";
  return text;
}

/// Returns a sentence about a leaf without error, or "" for another leaf.
std::string exactReason(const WhyReport& report) {
  const CellStep& last = report.history.steps.back();
  if (last.degree == kExactDegree)
    return fmt::format("Only {} can be nearest to points of the cell. The leaf keeps {}, and its distances are exact.",
                       countOf(last.triangles, "triangle", "triangles"), last.triangles == 1 ? "it" : "them");
  if (last.isWithoutError) return "All triangles that can be nearest to points of the cell lie in one plane.";
  return "";
}

std::string toleranceReason(const WhyReport& report) {
  const CellStep& last = report.history.steps.back();
  if (last.isMissed)
    return "No leaf within the tolerance was found, and smaller cells are not tried: the distance jumps here, or "
           "changes "
           "faster than the smallest cells can follow.";
  std::string text = exactReason(report);
  if (text.empty() && last.degreeTrial)
    text = fmt::format(
        "The polynomial of degree {} is the lowest one within the tolerance: its greatest error is {} of "
        "the allowed one.",
        *last.trialDegree, shortNumber(last.degreeTrial->error));
  if (last.octreeTrial)
    text += fmt::format(" Eight children would take {} or more.",
                        countOf(static_cast<std::size_t>(last.octreeTrial->bytes), "byte", "bytes"));
  return text;
}

/// Returns the part of the field's weighted error that the leaf has, as a sentence.
std::string shareText(const WhyReport& report) {
  const double total = report.field.metadata().totalError;
  if (!(total > 0)) return "";
  return fmt::format(" This cell has {} % of it.", shortNumber(100 * report.history.steps.back().weighted / total));
}

/// Returns the reason for which the refinement by errors ended.
std::string endReason(const WhyReport& report) {
  const FieldMetadata& metadata = report.field.metadata();
  const BuildOptions& settings = metadata.settings;
  const std::string target = shortNumber(settings.targetError.weighted()), total = shortNumber(metadata.totalError);
  const bool hasTarget = !settings.targetError.isNone();
  // Weak continuity and a final rise of all degrees change the error after the refinement.
  if (settings.continuityWeight && hasTarget)
    return fmt::format(
        "The refinement ended at the target error τ = {}. Weak continuity changed the polynomials of all "
        "cells afterwards; the errors above are those before.",
        target);
  if (settings.enrich && hasTarget)
    return fmt::format("The refinement ended at the target error τ = {}. Then all degrees were raised by one (enrich).",
                       target);
  // For errors near the surface and far from it, the error that was reached is stored as the target.
  if (hasTarget && metadata.totalError == settings.targetError.weighted())
    return fmt::format(
        "The refinement ended because the errors near the surface and far from it (near-error, far-error) "
        "were reached, at the weighted error {} of all cells together.{}",
        total, shareText(report));
  if (hasTarget && metadata.totalError < settings.targetError.weighted())
    return fmt::format(
        "The refinement ended because the weighted error of all cells together, {}, had fallen below the "
        "target τ = {}.{}",
        total, target, shareText(report));
  const std::string limit = settings.maxBytes
                                ? fmt::format("The limit of {} bytes (max-bytes)", grouped(*settings.maxBytes))
                                : "A limit of steps (max-steps)";
  return fmt::format("{} ended the refinement, at the weighted error {} of all cells together.{}", limit, total,
                     shareText(report));
}

std::string refinementReason(const WhyReport& report) {
  const CellHistory& history = report.history;
  const BuildOptions& settings = report.field.metadata().settings;
  const CellStep& last = history.steps.back();
  if (std::string text = exactReason(report); !text.empty()) return text;
  if (last.stage == CellStage::exactLeaves)
    return fmt::format(
        "The polynomial stands for the triangles of the cell, with an error of at most {} times the "
        "longest side (exact-tolerance).",
        shortNumber(settings.exactTolerance));
  if (last.isOutsideBand) return "The cell lies outside the narrow band, where cells are not refined.";
  if (settings.criterion == Criterion::optimal)
    return fmt::format(
        "The refinement went at least as far as this. Pruning then kept the depth and the degree that cost "
        "the fewest bytes for the error of the whole field.{}",
        settings.enrich ? " At the end, all degrees were raised by one (enrich)." : "");
  if (history.isAtLimit)
    return fmt::format("Depth and degree have reached their limits (max-depth {}, max-degree {}).", settings.maxDepth,
                       settings.maxDegree);
  if (last.stage == CellStage::maxError)
    return fmt::format("The refinement for the maximum error ended here; {} is allowed.",
                       shortNumber(settings.maxError));
  return endReason(report);
}

std::string leafReason(const WhyReport& report) {
  if (!report.history.agrees)
    return "The replay does not arrive at this leaf. The field was built by another version of the program, or it was "
           "changed afterwards.";
  return isWithinTolerance(report) ? toleranceReason(report) : refinementReason(report);
}

/// Returns what the construction was asked for.
std::string settingsLine(const WhyReport& report) {
  const BuildOptions& settings = report.field.metadata().settings;
  if (isWithinTolerance(report))
    return fmt::format("tolerance {}, within {} of the surface", shortNumber(settings.tolerance),
                       shortNumber(settings.within));
  std::string text = "strategy " + settingText(buildSetting("strategy"), settings);
  const bool wasGiven = report.field.metadata().totalError != settings.targetError.weighted();
  if (!settings.targetError.isNone() && wasGiven)
    text = fmt::format("target error τ = {}, {}", shortNumber(settings.targetError.weighted()), text);
  if (settings.maxError > 0) text += ", maximum error " + shortNumber(settings.maxError);
  if (settings.maxBytes) text += fmt::format(", at most {} bytes", grouped(*settings.maxBytes));
  return text;
}

/// Breaks a text into lines of at most `width` bytes.
std::vector<std::string> brokenLines(const std::string& text, std::size_t width) {
  std::vector<std::string> lines = {""};
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    if (!lines.back().empty() && lines.back().size() + 1 + word.size() > width) lines.emplace_back();
    lines.back() += (lines.back().empty() ? "" : " ") + word;
    begin = end + 1;
  }
  return lines;
}

}  // namespace

WhyReport whyAt(Session& session, const std::string& surface, const Vector3& x) {
  const CurrentField& current = session.current();
  const Box& domain = current.field.domain();
  if (!x.allFinite() || !domain.contains(x))
    throw Error(fmt::format("why: {} lies outside the field's domain, {}: give a point in it", vectorText(x, domain),
                            boxText(domain)));
  const ReferenceSurface& reference = session.referenceSurface(surface);
  WhyReport report{.point = x,
                   .value = current.field.value(x),
                   .exact = 0,
                   .history = {},
                   .nearest = {},
                   .windingNumber = {},
                   .field = current.field};
  (*reference.distance)(std::span(&x, 1), std::span(&report.exact, 1));
  report.history = withProgress(session.console(), [&](const Progress& progress) {
    return cellHistory(current.field, *reference.distance, x, progress);
  });
  if (CellStep& last = report.history.steps.back(); report.history.agrees && last.measuredMax)
    last.measuredMax = std::max(*last.measuredMax, std::abs(report.value - report.exact));
  if (reference.closest) report.nearest = reference.closest(x);
  if (reference.closest && current.field.metadata().source.insideTest != InsideTest::shell)
    report.windingNumber = windingNumber(reference.mesh, x);
  return report;
}

Json whyJson(const WhyReport& report) {
  const CellHistory& history = report.history;
  const CellStep& last = history.steps.back();
  Json nearest, sign = {{"inside", report.exact < 0},
                        {"test", insideTestName(report.field.metadata().source.insideTest)},
                        {"winding_number", optionalJson(report.windingNumber)}};
  if (report.nearest)
    nearest = {{"triangle", report.nearest->triangle},
               {"feature", featureName(report.nearest->feature)},
               {"point", vectorJson(report.nearest->point)},
               {"distance", (report.nearest->point - report.point).norm()}};
  Json steps = Json::array();
  for (const CellStep& step : history.steps) steps.push_back(stepJson(step));
  return {{"point", vectorJson(report.point)},
          {"value", report.value},
          {"exact", report.exact},
          {"error", report.value - report.exact},
          {"nearest", nearest},
          {"sign", sign},
          {"cell", history.cell.id},
          {"degree", degreeJson(history.cell.degree)},
          {"depth", history.cell.depth},
          {"box", boxJson(history.cell.box)},
          {"estimated_rms", optionalJson(last.estimatedRms)},
          {"measured_rms", optionalJson(last.measuredRms)},
          {"measured_max", optionalJson(last.measuredMax)},
          {"raised", countOfChoice(history, CellChoice::raise)},
          {"divided", countOfChoice(history, CellChoice::divide)},
          {"agrees", history.agrees ? 1 : 0},
          {"reason", leafReason(report)},
          {"steps", steps}};
}

std::string whyText(const WhyReport& report) {
  const CellHistory& history = report.history;
  const Box& domain = report.field.domain();
  std::string text = fmt::format("{}\n", vectorText(report.point, domain));
  text += summaryRow("field, exact", fmt::format("{:.6g}, {:.6g}: error {}", report.value, report.exact,
                                                 shortNumber(report.value - report.exact)));
  if (report.nearest)
    text += summaryRow("nearest", fmt::format("{} of triangle {} at {}", featureName(report.nearest->feature),
                                              report.nearest->triangle, vectorText(report.nearest->point, domain)));
  text += summaryRow("sign", signText(report));
  text += summaryRow("cell", fmt::format("{}: degree {}, depth {}, {}", history.cell.id, levelName(history.cell.degree),
                                         history.cell.depth, boxText(history.cell.box)));
  text += fmt::format("\nHow the construction arrived at this cell ({}):\n", settingsLine(report));
  text += isWithinTolerance(report) ? toleranceTable(history) : refinementTable(history);
  for (const std::string& line : brokenLines(leafReason(report), 96)) text += line + "\n";
  return text;
}

std::vector<std::string> whyLines(const WhyReport& report) {
  const CellHistory& history = report.history;
  std::vector<std::string> lines = {fmt::format("cell {}: degree {} at depth {}", history.cell.id,
                                                levelName(history.cell.degree), history.cell.depth)};
  const CellStep& last = history.steps.back();
  if (last.measuredRms)
    lines.push_back(fmt::format("error in the cell: RMS {}, greatest {}{}", shortNumber(*last.measuredRms),
                                shortNumber(last.measuredMax.value_or(0)),
                                last.estimatedRms ? ", estimated RMS " + shortNumber(*last.estimatedRms) : ""));
  if (report.nearest)
    lines.push_back(fmt::format("nearest: {} of triangle {}; {}", featureName(report.nearest->feature),
                                report.nearest->triangle, signText(report)));
  for (std::string& line : brokenLines(leafReason(report), 88)) lines.push_back(std::move(line));
  return lines;
}

}  // namespace hpsdf::app
