#include "session/field_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "construction/mesh_summary.h"
#include "hpsdf/detail/memory.h"
#include "text/json.h"
#include "text/printable.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr int kBarCells = 40;

template <typename Value>
Json levelsJson(const std::map<int, Value>& levels) {
  Json json = Json::object();
  for (const auto& [level, value] : levels) json[std::to_string(level)] = value;
  return json;
}

/// A row a level: share of the volume, number of leaves, a bar as long as the share.
std::string histogram(std::string_view name, const std::map<int, double>& volume,
                      const std::map<int, std::size_t>& leaves) {
  std::string text = fmt::format("\n  {:<8} {:>8} {:>12}\n", name, "volume", "leaves");
  for (const auto& [level, share] : volume) {
    std::string bar;
    const int cells = share > 0 ? std::max(1, static_cast<int>(std::lround(share * kBarCells))) : 0;
    for (int i = 0; i < cells; ++i) bar += "▇";
    text += fmt::format("  {:>8} {:>6.2f} % {:>12}  {}\n", level, 100 * share, grouped(leaves.at(level)), bar);
  }
  return text;
}

std::string fingerprintText(std::uint64_t fingerprint) { return fmt::format("{:016x}", fingerprint); }

}  // namespace

std::string nearnessName(NearnessKind kind) { return kind == NearnessKind::polynomial ? "polynomial" : "exponential"; }

std::string estimatorName(Estimator estimator) { return estimator == Estimator::embedded ? "embedded" : "residual"; }

std::string criterionName(Criterion criterion) { return criterion == Criterion::paper ? "paper" : "optimal"; }

std::string continuityName(const Field& field) {
  const bool weak = field.metadata().continuityWeight > 0, exact = field.data().blend > 0;
  return weak && exact ? "both" : weak ? "weak" : exact ? "exact" : "none";
}

std::string strategyName(Strategy strategy) {
  switch (strategy) {
    case Strategy::h1:
      return "h1";
    case Strategy::h2:
      return "h2";
    case Strategy::hp:
      break;
  }
  return "hp";
}

/// Of the leaves' errors, in ascending order; empty where none are kept.
std::vector<double> leafBounds(const Field& field) {
  std::vector<double> bounds;
  const FieldData& data = field.data();
  for (std::size_t n = 0; n < data.bounds.size(); ++n)
    if (node::isLeaf(data.nodes[n])) bounds.push_back(data.bounds[n].error);
  std::ranges::sort(bounds);
  return bounds;
}

Json boundsJson(const Field& field) {
  const std::vector<double> bounds = leafBounds(field);
  if (bounds.empty()) return {};
  return {{"median", bounds[bounds.size() / 2]}, {"greatest", bounds.back()}};
}

Json fieldJson(const CurrentField& current) {
  const Field& field = current.field;
  const FieldMetadata& metadata = field.metadata();
  const FieldStatistics figures = statistics(field);
  return {
      {"leaves", figures.leaves},
      {"nodes", figures.nodes},
      {"coefficients", figures.coefficients},
      {"precision", field.singlePrecision() ? "float" : "double"},
      {"bytes", figures.bytes},
      {"file_bytes", current.fileBytes ? Json(*current.fileBytes) : Json()},
      {"total_error", metadata.totalError},
      {"target_error", metadata.targetError},
      {"rms_estimate", metadata.rmsEstimate(field.domain())},
      {"rounding_rms", metadata.roundingRms},
      {"exact_evaluations", metadata.exactEvaluations},
      {"steps", metadata.steps ? Json(*metadata.steps) : Json()},
      {"domain", boxJson(field.domain())},
      {"grid", field.grid()},
      {"strategy", strategyName(metadata.strategy)},
      {"nearness", metadata.nearness},
      {"nearness_kind", nearnessName(metadata.nearnessKind)},
      {"estimator", estimatorName(metadata.estimator)},
      {"criterion", criterionName(metadata.criterion)},
      {"max_error", metadata.maxError > 0 ? Json(metadata.maxError) : Json()},
      {"measured_error", metadata.maxError > 0 ? Json(metadata.measuredError) : Json()},
      {"max_degree", metadata.maxDegree},
      {"max_depth", metadata.maxDepth},
      {"quadrature", metadata.quadrature},
      {"band", metadata.band},
      {"enriched", metadata.enriched},
      {"continuity_weight", metadata.continuityWeight > 0 ? Json(metadata.continuityWeight) : Json()},
      {"continuity", continuityName(field)},
      {"blend", field.data().blend},
      {"bounds", boundsJson(field)},
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
      {"depth_leaves", levelsJson(figures.depthLeaves)}};
}

std::string unitText(const Field& field) {
  const double scale = field.metadata().source.normalization.scale;
  if (scale == 1) return " (mesh units)";
  return fmt::format(" (normalized; {} in mesh units)",
                     shortNumber(field.metadata().rmsEstimate(field.domain()) / scale));
}

std::string fieldLine(const Field& field) {
  const FieldStatistics figures = statistics(field);
  return fmt::format("{} leaves, {} coefficients ({}), {}", grouped(figures.leaves), grouped(figures.coefficients),
                     field.singlePrecision() ? "float" : "double", bytesText(double(figures.bytes)));
}

std::string fieldText(const CurrentField& current) {
  const Field& field = current.field;
  const FieldMetadata& metadata = field.metadata();
  const FieldStatistics figures = statistics(field);
  const auto& grid = field.grid();
  const bool fromMesh = metadata.source.faces > 0;
  std::string text = current.name + "\n";
  text += summaryRow("made from", metadata.source.name.empty() ? "a function" : printable(metadata.source.name));
  if (fromMesh) {
    text += summaryRow("vertices, faces",
                       fmt::format("{}, {}", grouped(metadata.source.vertices), grouped(metadata.source.faces)));
    text += summaryRow("fingerprint", fingerprintText(metadata.source.fingerprint));
    text += summaryRow(
        "sign", insideTestName(metadata.source.insideTest) +
                    (metadata.source.thickness > 0 ? fmt::format(", {} thick", shortNumber(metadata.source.thickness))
                                                   : std::string()));
  }
  if (const Normalization& n = metadata.source.normalization; !n.isIdentity())
    text += summaryRow("normalized", fmt::format("field = {:.6g} · (mesh − {})", n.scale, vectorText(n.center)));
  text += summaryRow("domain", boxText(field.domain()));
  text += summaryRow("leaves", grouped(figures.leaves));
  text += summaryRow("coefficients", fmt::format("{} ({})", grouped(figures.coefficients),
                                                 field.singlePrecision() ? "float" : "double"));
  text += summaryRow("memory", bytesText(double(figures.bytes)));
  if (current.fileBytes) text += summaryRow("file", bytesText(double(*current.fileBytes)));
  text += summaryRow("error, target", fmt::format("{}, {} (at the scale where the longest side is 2)",
                                                  shortNumber(metadata.totalError), shortNumber(metadata.targetError)));
  text += summaryRow("estimated RMS error", shortNumber(metadata.rmsEstimate(field.domain())) + unitText(field));
  if (field.singlePrecision()) text += summaryRow("change by float", shortNumber(metadata.roundingRms) + " RMS");
  text += summaryRow("exact distances", grouped(metadata.exactEvaluations));
  if (metadata.steps) text += summaryRow("refinement steps", grouped(*metadata.steps));
  text += summaryRow("settings",
                     fmt::format("strategy {}, grid {}x{}x{}, nearness {}, degree ≤ {}, depth ≤ {}, quadrature {}",
                                 strategyName(metadata.strategy), grid[0], grid[1], grid[2], metadata.nearness,
                                 metadata.maxDegree, metadata.maxDepth, metadata.quadrature));
  text +=
      summaryRow("steering", fmt::format("{} nearness, {} estimator, {} criterion", nearnessName(metadata.nearnessKind),
                                         estimatorName(metadata.estimator), criterionName(metadata.criterion)));
  if (metadata.maxError > 0)
    text += summaryRow("greatest error, asked",
                       fmt::format("{}, {}", shortNumber(metadata.measuredError), shortNumber(metadata.maxError)));
  if (metadata.enriched) text += summaryRow("enriched", "every cell, by one degree at the end");
  if (metadata.continuityWeight > 0)
    text += summaryRow("continuity", fmt::format("weak, weight {}", shortNumber(metadata.continuityWeight)));
  if (metadata.band > 0) text += summaryRow("narrow band", fmt::format("{}", metadata.band));
  if (const double width = field.data().blend; width > 0)
    text += summaryRow("continuity", fmt::format("exact: blended within {} of an edge from faces", width));
  if (const auto bounds = leafBounds(field); !bounds.empty())
    text += summaryRow("bounds of the error",
                       fmt::format("{} in the median, {} at most", shortNumber(bounds[bounds.size() / 2]),
                                   shortNumber(bounds.back())));
  text += histogram("degree", figures.degreeVolume, figures.degreeLeaves);
  text += histogram("depth", figures.depthVolume, figures.depthLeaves);
  return text;
}

}  // namespace hpsdf::app
