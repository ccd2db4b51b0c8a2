#include <fmt/format.h>

#include <chrono>
#include <numeric>

#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "construction/build_field.h"
#include "files/output_folder.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/jumps.h"
#include "hpsdf/verify.h"
#include "language/script.h"
#include "session/session.h"
#include "study/study_command.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Width of the region near the surface, as a fraction of the domain's longest edge.
constexpr double kNear = 0.01;

/// Measures the jumps and errors of several fields of one mesh, with and without smoothing across cell faces.
class ContinuityStudy {
 public:
  ContinuityStudy(Session& session, const Arguments& arguments, std::size_t mesh)
      : console_(session.console()),
        arguments_(arguments),
        mesh_(arguments.texts("mesh")[mesh]),
        buildArguments_(buildArguments(session, arguments, mesh)),
        input_(buildInput(console_, mesh_, buildArguments_)),
        uniform_(samples(0)),
        near_(samples(kNear * input_.domain.sizes().maxCoeff())) {}

  /// Builds the fields of the mesh and adds one row to `rows` for each. Jumps, errors and bytes are also given relative
  /// to the first of these fields, which is neither smoothed nor refitted with a higher degree
  /// (`BuildOptions::enrich`).
  void addRows(Json& rows) {
    for (const bool enriched : {false, true}) {
      BuildOptions options = input_.options;
      options.enrich = enriched;
      const auto begin = std::chrono::steady_clock::now();
      const Field built = withProgress(console_, [&](const Progress& progress) {
        return withinMemory(buildArguments_, [&] { return build(*input_.exact, input_.domain, options, progress); });
      });
      const double buildSeconds = input_.setUpSeconds + secondsSince(begin);
      rows.push_back(rowOf(built, enriched, {}, 0, 0, buildSeconds));
      for (const double weight : arguments_.numbers("weights")) {
        const auto start = std::chrono::steady_clock::now();
        const WeaklyContinuous made = withProgress(console_, [&](const Progress& progress) {
          return weaklyContinuous(built, {.weight = weight}, options.threads, progress);
        });
        rows.push_back(rowOf(made.field, enriched, weight, made.iterations, secondsSince(start), buildSeconds));
      }
    }
  }

 private:
  ExactSamples samples(double near) const {
    return exactSamples(console_, arguments_, *input_.exact, input_.domain, input_.options.threads, near);
  }

  /// Measures a field and returns its row of the table. `weight` is null for a field that is not smoothed.
  Json rowOf(const Field& field, bool enriched, const Json& weight, int iterations, double seconds,
             double buildSeconds) {
    Json row = {{"mesh", mesh_}, {"enriched", enriched}, {"weight", weight}};
    const auto add = [&](const std::string& name, const Json& figure) {
      row[name] = figure;
      row[name + "_ratio"] = figure.get<double>() / (first_.is_null() ? row : first_)[name].get<double>();
    };
    const int threads = input_.options.threads;
    const JumpTotals jumps =
        withProgress(console_, [&](const Progress& progress) { return measureJumps(field, threads, progress); });
    add("jump_rms", jumps.value.rms);
    add("jump_max", jumps.value.max);
    add("rms", measureError(field, uniform_, threads).rms);
    add("near_rms", measureError(field, near_, threads).rms);
    add("bytes", field.bytes());
    row.update({{"iterations", iterations},
                {"seconds", seconds},
                {"build_seconds", buildSeconds},
                {"seconds_ratio", seconds / buildSeconds}});
    if (first_.is_null()) first_ = row;
    return row;
  }

  const Console& console_;
  const Arguments& arguments_;
  std::string mesh_;
  Arguments buildArguments_;
  BuildInput input_;
  ExactSamples uniform_, near_;
  Json first_;  ///< row of the mesh's first field; null until it is measured
};

/// Returns the rows as a CSV table, without the column of construction times.
std::string csv(Json rows) {
  std::string head, body;
  for (Json& row : rows) {
    row.erase("build_seconds");
    body += rowText(row) + "\n";
  }
  for (const auto& [name, value] : rows.front().items()) head += (head.empty() ? "" : ",") + name;
  return head + "\n" + body;
}

std::string table(const Json& rows) {
  std::string text, mesh;
  for (const Json& row : rows) {
    const auto number = [&](const char* name) { return numberIn(row, name); };
    if (row["mesh"].get<std::string>() != mesh) {
      mesh = row["mesh"].get<std::string>();
      text += fmt::format("{}{}: RMS jump {}, greatest {}, RMS error {}, near the surface {}, {}, built in {:.1f} s\n",
                          text.empty() ? "" : "\n", mesh, shortNumber(number("jump_rms")),
                          shortNumber(number("jump_max")), shortNumber(number("rms")), shortNumber(number("near_rms")),
                          bytesText(number("bytes")), number("build_seconds"));
      text += fmt::format("  {:<10} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7} {:>6} {:>9}\n", "", "weight", "RMS jump",
                          "max jump", "error", "near", "bytes", "steps", "time");
    }
    const bool isSmoothed = !row["weight"].is_null();
    text += fmt::format("  {:<10} {:>9} {:>7.3f} × {:>7.3f} × {:>7.3f} × {:>7.3f} × {:>5.2f} ×",
                        row["enriched"].get<bool>() ? "enriched" : "",
                        isSmoothed ? shortNumber(number("weight")) : "none", number("jump_rms_ratio"),
                        number("jump_max_ratio"), number("rms_ratio"), number("near_rms_ratio"), number("bytes_ratio"));
    text +=
        isSmoothed ? fmt::format(" {:>6} {:>7.2f} ×\n", row["iterations"].get<int>(), number("seconds_ratio")) : "\n";
  }
  return text;
}

void runContinuity(Session& session, const Arguments& arguments) {
  OutputFolder folder(arguments.text("output"));
  checkWritable(folder.path() / "continuity.csv");
  const std::size_t count = checkedNames(session, arguments).size();
  Json rows = Json::array();
  for (std::size_t n = 0; n < count; ++n) ContinuityStudy(session, arguments, n).addRows(rows);

  folder.write("continuity.csv", csv(rows));
  folder.write("continuity.json", jsonText(rows));
  folder.commit();
  if (session.wantsJson(arguments)) return printJson(session.console().out, rows);
  session.console().out << table(rows) << (folder.path() / "continuity.csv").string() << "\n"
                        << (folder.path() / "continuity.json").string() << "\n";
}

}  // namespace

Study continuityStudy() {
  std::vector<std::size_t> counts(32);
  std::iota(counts.begin(), counts.end(), 1);
  std::vector<std::string> left = endParametersAndTheirs(
      {BuildSetting::Ending::tolerance, BuildSetting::Ending::otherQuantity, BuildSetting::Ending::steps});
  left.insert(left.end(), {"enrich", "continuity", "continuity-weight", "blend-width", "bounds", "paper"});
  return {
      .name = "continuity",
      .help = paragraphs(R"(
the trade of weak continuity. Each mesh is built twice, as the options say and with every degree one higher at the end,
and each field is smoothed with each weight. For each: the RMS jump and the greatest between cells, the measured RMS
error over the domain and near the surface, bytes, the solver's steps, and its time over the construction's. Ratios are
over the mesh's field that was neither enriched nor smoothed. Writes continuity.csv and continuity.json.)"),
      .parameters = joined(
          {{{"weights",
             numbers("λ,λ,…", counts).above(0).atMost(kMaxContinuityWeight).byDefault("30,10,2.5,1,0.4,0.1,0.03"),
             "λ of weak continuity, one row each."}},
           samplingParameters(),
           buildParametersWithout(left)}),
      .run = runContinuity,
  };
}

}  // namespace hpsdf::app
