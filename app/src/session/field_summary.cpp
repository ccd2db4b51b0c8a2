#include "session/field_summary.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "construction/mesh_summary.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/memory.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr int kHistogramColumns = 40;
constexpr double kVisiblyMissed = 1.005;  // errors over the allowed ones that three digits distinguish from 1

/// Returns a table with one row for each level (a degree or a depth). A row shows the level's share of the volume, its
/// number of leaves, and a bar proportional to the share.
std::string histogram(std::string_view name, const std::map<int, double>& volume,
                      const std::map<int, std::size_t>& leaves) {
  std::string text = fmt::format("\n  {:<8} {:>8} {:>12}\n", name, "volume", "leaves");
  for (const auto& [level, share] : volume) {
    const int cells = share > 0 ? std::max(1, static_cast<int>(std::lround(share * kHistogramColumns))) : 0;
    text += fmt::format("  {:>8} {:>6.2f} % {:>12}  {:▇<{}}\n", levelName(level), 100 * share,
                        grouped(leaves.at(level)), "", cells);
  }
  return text;
}

/// Returns the word for an exactness in JSON.
std::string exactnessWord(Exactness exactness) {
  constexpr std::array<const char*, 4> kWords = {"everywhere", "outside", "inside", "nowhere"};
  return kWords[static_cast<std::size_t>(exactness)];
}

std::string fingerprintText(std::uint64_t fingerprint) { return fmt::format("{:016x}", fingerprint); }

}  // namespace

std::string strategyName(Strategy strategy) {
  return settingText(buildSetting("strategy"), BuildOptions{.strategy = strategy});
}

Json boundsJson(const Field& field) {
  std::vector<double> bounds;
  const FieldData& data = field.data();
  for (std::size_t n = 0; n < data.bounds.size(); ++n)
    if (node::isLeaf(data.nodes[n])) bounds.push_back(data.bounds[n].error);
  if (bounds.empty()) return {};
  std::ranges::sort(bounds);
  return {{"median", bounds[bounds.size() / 2]}, {"greatest", bounds.back()}};
}

/// Returns the value of a setting as JSON: a number, a word, true or false. Returns null for a setting that
/// has no value.
Json settingJson(const BuildSetting& setting, const BuildOptions& options) {
  const std::vector<double> numbers = setting.get(options);
  if (numbers.empty()) return {};
  if (setting.type == BuildSetting::Type::number) return numbers[0];
  if (setting.type == BuildSetting::Type::wholeNumber) return static_cast<std::int64_t>(numbers[0]);
  if (setting.type == BuildSetting::Type::flag) return numbers[0] != 0;
  return settingText(setting, options);
}

/// Adds the settings that a field file stores to the JSON object. In the keys, hyphens become underscores.
void addSettings(Json& json, const BuildOptions& settings) {
  for (const BuildSetting& setting : buildSettings()) {
    if (setting.storedAt == 0) continue;
    std::string key(setting.key.empty() ? setting.name : setting.key);
    std::ranges::replace(key, '-', '_');
    json[key] = settingJson(setting, settings);
  }
}

Json exactJson(const ExactLeafStatistics& exact) {
  if (exact.leaves == 0) return {};
  return {{"leaves", exact.leaves},
          {"triangles", exact.triangles},
          {"median_list", exact.medianList},
          {"longest_list", exact.longestList}};
}

Json bytesJson(const FieldBytes& bytes) {
  return {{"nodes", bytes.nodes},
          {"coefficients", bytes.coefficients},
          {"exact_triangles", bytes.exactTriangles},
          {"lookup_grid", bytes.lookupGrid},
          {"bounds", bytes.bounds}};
}

Json fieldJson(const CurrentField& current) {
  const Field& field = current.field;
  const FieldMetadata& metadata = field.metadata();
  const FieldStatistics figures = statistics(field);
  Json json = {{"leaves", figures.leaves},
               {"nodes", figures.nodes},
               {"coefficients", figures.coefficients},
               {"precision", precisionName(field)},
               {"bytes", figures.bytes},
               {"file_bytes", current.fileBytes ? Json(*current.fileBytes) : Json()},
               {"total_error", metadata.hasEstimate() ? Json(metadata.totalError) : Json()},
               {"rms_estimate", metadata.hasEstimate() ? Json(metadata.rmsEstimate(field.domain())) : Json()},
               {"measured", measuredJson(field)},
               {"rounding_rms", metadata.roundingRms},
               {"exact_evaluations", metadata.exactEvaluations},
               {"steps", metadata.steps ? Json(*metadata.steps) : Json()},
               {"domain", boxJson(field.domain())},
               {"grid", field.grid()}};
  addSettings(json, metadata.settings);
  json["target_error"] = metadata.hasEstimate() ? Json(metadata.settings.targetError.weighted()) : Json();
  json["measured_error"] =
      metadata.settings.maxError > 0 || hasTolerance(field) ? Json(metadata.measuredError) : Json();
  json.update(
      {{"continuity", settingText(buildSetting("continuity"), settingsOf(field.data()))},
       {"blend", field.data().blend},
       {"bounds", boundsJson(field)},
       {"exact", metadata.source.exactness ? Json(exactnessWord(*metadata.source.exactness)) : Json()},
       {"reference_length", metadata.referenceLength},
       {"normalization",
        {{"center", vectorJson(metadata.source.normalization.center)}, {"scale", metadata.source.normalization.scale}}},
       {"mesh",
        {{"name", metadata.source.name},
         {"fingerprint", fingerprintText(metadata.source.fingerprint)},
         {"vertices", metadata.source.vertices},
         {"faces", metadata.source.faces},
         {"sign", metadata.source.faces > 0 ? Json(insideTestName(metadata.source.insideTest)) : Json()},
         {"thickness", metadata.source.thickness > 0 ? Json(metadata.source.thickness) : Json()}}},
       {"degree_volume", levelsJson(figures.degreeVolume)},
       {"depth_volume", levelsJson(figures.depthVolume)},
       {"degree_leaves", levelsJson(figures.degreeLeaves)},
       {"depth_leaves", levelsJson(figures.depthLeaves)}});
  if (const Json exact = exactJson(figures.exact); !exact.is_null()) {
    json["exact_leaves"] = exact;
    json["bytes_of_parts"] = bytesJson(field.bytesOfParts());
  }
  return json;
}

/// Returns the unit of a field's lengths in parentheses.
std::string unitText(const Field& field) {
  const double scale = field.metadata().source.normalization.scale;
  return scale == 1 ? " (mesh units)" : fmt::format(" (normalized: {} mesh units each)", shortNumber(1 / scale));
}

std::string errorText(const Measurement::Error& error) {
  return fmt::format("RMS {}, greatest {}", shortNumber(error.rms), shortNumber(error.max));
}

std::string tornText(const Measurement& m) {
  return fmt::format("{} % of the surface torn", shortNumber(100 * m.tornShare));
}

std::string wrongSignsText(const Measurement& m) {
  return fmt::format("{} of {} points beyond {} on the wrong side", grouped(m.wrongSigns), grouped(m.points),
                     shortNumber(m.signThreshold));
}

bool hasTolerance(const Field& field) { return field.metadata().settings.tolerance > 0; }

bool missesTolerance(const Field& field) {
  const FieldMetadata& metadata = field.metadata();
  if (!hasTolerance(field)) return false;
  return metadata.measuredError > metadata.settings.tolerance ||
         (metadata.measurement && metadata.measurement->beyondTolerance > 0);
}

std::string toleranceText(const Field& field) {
  const BuildOptions& settings = field.metadata().settings;
  const std::optional<Measurement>& m = field.metadata().measurement;
  std::string text = fmt::format("{} within {} of the surface, and 1 % of the distance beyond",
                                 shortNumber(settings.tolerance), shortNumber(settings.within));
  if (const double ratio = field.metadata().measuredError / settings.tolerance; ratio > 1)
    return text + "; missed in some cells" +
           (ratio > kVisiblyMissed ? fmt::format(", where the error is up to {:.3g} times as great", ratio) : "");
  if (!m) return text + "; not measured";
  if (m->beyondTolerance > 0)
    return text + fmt::format("; missed at {} of {} points, where the error is up to {:.3g} times as great",
                              grouped(m->beyondTolerance), grouped(m->points), m->toleranceRatio);
  return text + fmt::format("; {}, errors reach {:.0f} % of it at {} random points",
                            settings.certified ? "certified" : "kept", 100 * m->toleranceRatio, grouped(m->points));
}

std::string measuredText(const Field& field) {
  const std::optional<Measurement>& m = field.metadata().measurement;
  if (!m) return "not measured";
  return fmt::format("near the surface {}; over the domain {}{}{}{}", errorText(m->near), errorText(m->domain),
                     m->wrongSigns > 0 ? "; " + wrongSignsText(*m) : "", m->tornShare > 0 ? "; " + tornText(*m) : "",
                     unitText(field));
}

std::string exactnessText(const Field& field) {
  const std::optional<Exactness>& exactness = field.metadata().source.exactness;
  if (!exactness) return "";
  switch (*exactness) {
    case Exactness::everywhere:
      return "exact everywhere";
    case Exactness::outside:
      return "exact outside; a lower bound inside";
    case Exactness::inside:
      return "exact inside; a lower bound outside";
    default:
      return "a lower bound; the surface may be farther away than the values say";
  }
}

std::string estimateLine(const Field& field) {
  const FieldMetadata& metadata = field.metadata();
  const std::optional<Measurement>& m = metadata.measurement;
  const std::string asked =
      hasTolerance(field)      ? fmt::format("tolerance {}, ", shortNumber(metadata.settings.tolerance))
      : metadata.hasEstimate() ? fmt::format("weighted estimate (τ) {}, ", shortNumber(metadata.totalError))
                               : "";
  return asked + (m ? "measured near the surface " + errorText(m->near) : "not measured");
}

Json measuredJson(const Field& field) {
  const std::optional<Measurement>& m = field.metadata().measurement;
  if (!m) return {};
  const auto errorJson = [](const Measurement::Error& error) { return Json{{"rms", error.rms}, {"max", error.max}}; };
  return {{"points", m->points},
          {"near_distance", m->nearDistance},
          {"near", errorJson(m->near)},
          {"domain", errorJson(m->domain)},
          {"wrong_signs", m->wrongSigns},
          {"sign_threshold", m->signThreshold},
          {"torn_share", m->tornShare},
          {"worst_point", vectorJson(m->worst)},
          {"tolerance_ratio", hasTolerance(field) ? Json(m->toleranceRatio) : Json()},
          {"beyond_tolerance", hasTolerance(field) ? Json(m->beyondTolerance) : Json()}};
}

std::string exactCountText(const FieldStatistics& figures) {
  return figures.exact.leaves == 0 ? "" : fmt::format(" ({} exact)", grouped(figures.exact.leaves));
}

std::string exactTrianglesText(const ExactLeafStatistics& exact) {
  return fmt::format("{}; a leaf lists {} in the median, {} at most", grouped(exact.triangles),
                     grouped(exact.medianList), grouped(exact.longestList));
}

std::string memoryText(const Field& field) {
  const FieldBytes bytes = field.bytesOfParts();
  std::string text = bytesText(double(bytes.total()));
  if (field.isMapped())
    return bytesText(double(bytes.total() - bytes.coefficients)) +
           fmt::format(", and {} of the file mapped", bytesText(double(bytes.coefficients)));
  if (bytes.exactTriangles == 0) return text;
  text += " (";
  const auto part = [&](std::string_view name, std::size_t size) {
    if (size > 0) text += fmt::format("{}{} {}", text.ends_with('(') ? "" : ", ", name, bytesText(double(size)));
  };
  part("nodes", bytes.nodes);
  part("coefficients", bytes.coefficients);
  part("triangles", bytes.exactTriangles);
  part("lookup grid", bytes.lookupGrid);
  part("bounds", bytes.bounds);
  return text + ")";
}

std::string fieldLine(const Field& field) {
  const FieldStatistics figures = statistics(field);
  const std::string triangles =
      figures.exact.leaves == 0 ? "" : fmt::format("{} triangles, ", grouped(figures.exact.triangles));
  return fmt::format("{} leaves{}, {} coefficients ({}), {}{}", grouped(figures.leaves), exactCountText(figures),
                     grouped(figures.coefficients), precisionName(field), triangles, memoryText(field));
}

/// Returns as text the build settings that a field file stores, except the target error. If `ofWords` is true, includes
/// only settings whose values are words, otherwise only settings whose values are numbers.
std::string settingsText(const BuildOptions& settings, bool ofWords) {
  std::vector<std::string> parts;
  for (const BuildSetting& setting : buildSettings()) {
    const bool isWord = setting.type == BuildSetting::Type::choice || setting.type == BuildSetting::Type::flag;
    const std::string text = settingText(setting, settings);
    const bool isShown =
        setting.storedAt > 0 && setting.isOffered && setting.ending != BuildSetting::Ending::target && !text.empty();
    if (isShown && isWord == ofWords) parts.push_back(fmt::format("{} {}", setting.name, text));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string fieldText(const CurrentField& current) {
  const Field& field = current.field;
  const FieldMetadata& metadata = field.metadata();
  const FieldStatistics figures = statistics(field);
  const auto& grid = field.grid();
  const bool fromMesh = metadata.source.faces > 0;
  std::string text = current.name + "\n";
  const auto row = [&](std::string_view label, const std::string& value) { text += summaryRow(label, value); };
  row("made from", metadata.source.name.empty() ? "a function" : printable(metadata.source.name));
  if (const std::string exactness = exactnessText(field); !exactness.empty()) row("distances", exactness);
  if (fromMesh) {
    row("vertices, faces", fmt::format("{}, {}", grouped(metadata.source.vertices), grouped(metadata.source.faces)));
    row("fingerprint", fingerprintText(metadata.source.fingerprint));
    row("sign", insideTestName(metadata.source.insideTest) +
                    (metadata.source.thickness > 0 ? fmt::format(", {} thick", shortNumber(metadata.source.thickness))
                                                   : std::string()));
  }
  if (const Normalization& n = metadata.source.normalization; !n.isIdentity())
    row("normalized", fmt::format("field = {:.6g} · (mesh − {})", n.scale, vectorText(n.center)));
  row("domain", boxText(field.domain()));
  row("leaves", grouped(figures.leaves) + exactCountText(figures));
  row("coefficients", fmt::format("{} ({})", grouped(figures.coefficients), precisionName(field)));
  if (figures.exact.leaves > 0) row("exact triangles", exactTrianglesText(figures.exact));
  row("memory", memoryText(field));
  if (current.fileBytes) row("file", bytesText(double(*current.fileBytes)));
  if (hasTolerance(field)) row("tolerance", toleranceText(field) + unitText(field));
  if (metadata.hasEstimate())
    row("error, target",
        fmt::format("{}, {} (at the scale where the longest side is 2)", shortNumber(metadata.totalError),
                    shortNumber(metadata.settings.targetError.weighted())));
  if (const std::optional<Measurement>& m = metadata.measurement) {
    row("error near surface", fmt::format("{}, within {} of the surface{}", errorText(m->near),
                                          shortNumber(m->nearDistance), unitText(field)));
    row("error over domain", errorText(m->domain) + unitText(field));
    row("worst point", vectorText(m->worst));
    row("signs, cracks", wrongSignsText(*m) + "; " + tornText(*m));
  } else {
    row("measured", "no, or not since the field was changed; 'hpsdf verify' measures it");
  }
  if (metadata.hasEstimate())
    row("weighted estimate", shortNumber(metadata.rmsEstimate(field.domain())) + ", √(ε/|Ω|)" + unitText(field));
  if (metadata.roundingRms > 0) row("change by rounding", shortNumber(metadata.roundingRms) + " RMS");
  row("exact distances", grouped(metadata.exactEvaluations));
  if (metadata.steps) row("refinement steps", grouped(*metadata.steps));
  row("base grid", fmt::format("{} x {} x {}", grid[0], grid[1], grid[2]));
  if (metadata.hasEstimate()) {
    row("settings", settingsText(metadata.settings, false));
    row("", settingsText(metadata.settings, true));
  } else if (metadata.settings.continuityWeight) {
    row("continuity", fmt::format("weak, weight {}", shortNumber(*metadata.settings.continuityWeight)));
  }
  if (metadata.settings.maxError > 0) row("greatest error", shortNumber(metadata.measuredError));
  if (const double width = field.data().blend; width > 0)
    row("continuity", fmt::format("exact: blended within {} of an edge from faces", width));
  if (const Json bounds = boundsJson(field); !bounds.is_null())
    row("bounds of the error", fmt::format("{} in the median, {} at most", shortNumber(bounds["median"].get<double>()),
                                           shortNumber(bounds["greatest"].get<double>())));
  text += histogram("degree", figures.degreeVolume, figures.degreeLeaves);
  text += histogram("depth", figures.depthVolume, figures.depthLeaves);
  return text;
}

}  // namespace hpsdf::app
