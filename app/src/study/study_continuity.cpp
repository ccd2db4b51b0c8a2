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
#include "study/study.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Width of the region near the surface, as a share of the domain's longest edge.
constexpr double kNear = 0.01;

struct ContinuityRow {
  std::string mesh;
  bool enriched = false;
  double weight = 0;  ///< λ; 0 without weak continuity
  double jump = 0, greatestJump = 0, rms = 0, nearRms = 0;
  std::size_t bytes = 0;
  int iterations = 0;
  double seconds = 0;       ///< time of the post-process
  double buildSeconds = 0;  ///< time of the construction
};

/// A row with its ratios to `first`, the mesh's field without enrichment and without weak continuity.
struct Compared {
  const ContinuityRow& row;
  const ContinuityRow& first;
  double jump() const { return row.jump / first.jump; }
  double greatestJump() const { return row.greatestJump / first.greatestJump; }
  double rms() const { return row.rms / first.rms; }
  double nearRms() const { return row.nearRms / first.nearRms; }
  double bytes() const { return double(row.bytes) / double(first.bytes); }
  double time() const { return row.seconds / row.buildSeconds; }
};

/// Measures the fields of one mesh.
class ContinuityStudy {
 public:
  ContinuityStudy(Session& session, const Arguments& arguments, std::size_t mesh)
      : console_(session.console()),
        arguments_(arguments),
        mesh_(arguments.texts("mesh")[mesh]),
        input_(buildInput(console_, mesh_, buildArguments(session, arguments, mesh))) {
    takeSamples();
  }

  std::vector<ContinuityRow> run() {
    std::vector<ContinuityRow> rows;
    for (const bool enriched : {false, true}) {
      BuildOptions options = input_.options;
      options.enrich = enriched;
      const auto begin = std::chrono::steady_clock::now();
      const Field built = withProgress(
          console_, [&](const Progress& progress) { return build(*input_.exact, input_.domain, options, progress); });
      ContinuityRow row{.mesh = mesh_, .enriched = enriched, .buildSeconds = input_.setUpSeconds + secondsSince(begin)};
      measure(built, row);
      rows.push_back(row);
      for (const double weight : arguments_.numbers("weights")) {
        const auto start = std::chrono::steady_clock::now();
        const WeaklyContinuous made = withProgress(console_, [&](const Progress& progress) {
          return weaklyContinuous(built, {.weight = weight}, options.threads, progress);
        });
        row.seconds = secondsSince(start);
        row.weight = weight;
        row.iterations = made.iterations;
        measure(made.field, row);
        rows.push_back(row);
      }
    }
    return rows;
  }

 private:
  void takeSamples() {
    const SampleOptions sampling = sampleOptions(arguments_, input_.options.threads);
    const double near = kNear * input_.domain.sizes().maxCoeff();
    withProgress(console_, [&](const Progress& progress) {
      uniform_ = sampleUniform(*input_.exact, input_.domain, 0, sampling, progress);
      near_ = sampleUniform(*input_.exact, input_.domain, near, sampling, progress);
      return 0;
    });
  }

  void measure(const Field& field, ContinuityRow& row) const {
    const Jumps jumps = withProgress(
        console_, [&](const Progress& progress) { return findJumps(field, input_.options.threads, progress); });
    row.jump = jumps.value.rms;
    row.greatestJump = jumps.value.max;
    row.rms = measureError(field, uniform_, input_.options.threads).rms;
    row.nearRms = measureError(field, near_, input_.options.threads).rms;
    row.bytes = field.bytes();
  }

  const Console& console_;
  const Arguments& arguments_;
  std::string mesh_;
  BuildInput input_;
  ExactSamples uniform_, near_;
};

/// A CSV field in quotes, because the names of shapes contain commas.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

std::string csv(const std::vector<Compared>& rows) {
  std::string text =
      "mesh,enriched,weight,jump_rms,jump_rms_ratio,jump_max,jump_max_ratio,rms,rms_ratio,near_rms,near_rms_ratio,"
      "bytes,bytes_ratio,iterations,seconds,seconds_ratio\n";
  for (const Compared& ratio : rows) {
    const ContinuityRow& row = ratio.row;
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", quoted(row.mesh), int(row.enriched),
                        row.weight > 0 ? fmt::format("{}", row.weight) : "", row.jump, ratio.jump(), row.greatestJump,
                        ratio.greatestJump(), row.rms, ratio.rms(), row.nearRms, ratio.nearRms(), row.bytes,
                        ratio.bytes(), row.iterations, row.seconds, ratio.time());
  }
  return text;
}

Json json(const std::vector<Compared>& rows) {
  Json all = Json::array();
  for (const Compared& ratio : rows) {
    const ContinuityRow& row = ratio.row;
    all.push_back({{"mesh", row.mesh},
                   {"enriched", row.enriched},
                   {"weight", row.weight > 0 ? Json(row.weight) : Json()},
                   {"jump_rms", row.jump},
                   {"jump_rms_ratio", ratio.jump()},
                   {"jump_max", row.greatestJump},
                   {"jump_max_ratio", ratio.greatestJump()},
                   {"rms", row.rms},
                   {"rms_ratio", ratio.rms()},
                   {"near_rms", row.nearRms},
                   {"near_rms_ratio", ratio.nearRms()},
                   {"bytes", row.bytes},
                   {"bytes_ratio", ratio.bytes()},
                   {"iterations", row.iterations},
                   {"seconds", row.seconds},
                   {"build_seconds", row.buildSeconds},
                   {"seconds_ratio", ratio.time()}});
  }
  return all;
}

std::string table(const std::vector<Compared>& rows) {
  std::string text, mesh;
  for (const Compared& ratio : rows) {
    const ContinuityRow& row = ratio.row;
    if (row.mesh != mesh) {
      mesh = row.mesh;
      text +=
          fmt::format("{}{}: RMS jump {}, greatest {}, RMS error {}, near the surface {}, {}, built in {:.1f} s\n",
                      text.empty() ? "" : "\n", mesh, shortNumber(row.jump), shortNumber(row.greatestJump),
                      shortNumber(row.rms), shortNumber(row.nearRms), bytesText(double(row.bytes)), row.buildSeconds);
      text += fmt::format("  {:<10} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7} {:>6} {:>9}\n", "", "weight", "RMS jump",
                          "max jump", "error", "near", "bytes", "steps", "time");
    }
    text += fmt::format("  {:<10} {:>9} {:>7.3f} × {:>7.3f} × {:>7.3f} × {:>7.3f} × {:>5.2f} ×",
                        row.enriched ? "enriched" : "", row.weight > 0 ? shortNumber(row.weight) : "none", ratio.jump(),
                        ratio.greatestJump(), ratio.rms(), ratio.nearRms(), ratio.bytes());
    text += row.weight > 0 ? fmt::format(" {:>6} {:>7.2f} ×\n", row.iterations, ratio.time()) : "\n";
  }
  return text;
}

void runContinuity(Session& session, const Arguments& arguments) {
  OutputFolder folder(arguments.text("output"));
  checkWritable(folder.path() / "continuity.csv");
  const std::vector<std::string> meshes = arguments.texts("mesh");
  for (std::size_t n = 0; n < meshes.size(); ++n)
    buildArguments(session, arguments, n);  // reports mistakes before the long work
  std::vector<std::vector<ContinuityRow>> all;
  for (std::size_t n = 0; n < meshes.size(); ++n) all.push_back(ContinuityStudy(session, arguments, n).run());
  std::vector<Compared> rows;
  for (const auto& ofMesh : all)
    for (const ContinuityRow& row : ofMesh) rows.push_back({row, ofMesh.front()});

  folder.write("continuity.csv", csv(rows));
  folder.write("continuity.json", json(rows).dump(2) + "\n");
  folder.commit();
  if (session.wantsJson(arguments)) return printJson(session.console().out, json(rows));
  session.console().out << table(rows) << (folder.path() / "continuity.csv").string() << "\n"
                        << (folder.path() / "continuity.json").string() << "\n";
}

}  // namespace

Study continuityStudy() {
  std::vector<std::size_t> counts(32);
  std::iota(counts.begin(), counts.end(), 1);
  std::vector<std::string> left = endParameters({BuildSetting::Ending::otherQuantity, BuildSetting::Ending::steps});
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
