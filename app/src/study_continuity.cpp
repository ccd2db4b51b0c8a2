#include "study_continuity.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <random>

#include "building.h"
#include "commands.h"
#include "hpsdf/continuity.h"
#include "hpsdf/jumps.h"
#include "hpsdf/output_file.h"
#include "long_work.h"
#include "script.h"
#include "session.h"
#include "summaries.h"

namespace hpsdf::app {
namespace {

/// Near the surface: within this part of the mesh's longest side.
constexpr double kNear = 0.01;

/// Points with their exact distances.
struct Samples {
  std::vector<Vector3> points;
  std::vector<double> exact;

  double rmsError(const Field& field) const {
    std::vector<double> values(points.size());
    field.values(points, values);
    double squares = 0;
    for (std::size_t i = 0; i < values.size(); ++i) squares += (values[i] - exact[i]) * (values[i] - exact[i]);
    return std::sqrt(squares / double(points.size()));
  }
};

class PointMaker {
 public:
  PointMaker(const Box& domain, std::uint64_t seed) : domain_(domain), random_(seed) {}

  Vector3 operator()() {
    Vector3 x;
    for (int axis = 0; axis < 3; ++axis)
      x[axis] = domain_.min()[axis] + double(random_()) * 0x1p-64 * domain_.sizes()[axis];
    return x;
  }

 private:
  Box domain_;
  std::mt19937_64 random_;
};

void measureExact(Samples& samples, const DistanceFunction& exact, const Progress& progress) {
  constexpr std::size_t kBatch = 4096;
  samples.exact.resize(samples.points.size());
  for (std::size_t first = 0; first < samples.points.size(); first += kBatch) {
    if (progress.cancelled()) throw Cancelled();
    progress.report("exact distances", double(first) / double(samples.points.size()));
    const std::size_t count = std::min(kBatch, samples.points.size() - first);
    exact(std::span(samples.points).subspan(first, count), std::span(samples.exact).subspan(first, count));
  }
}

Samples uniformSamples(const Box& domain, const DistanceFunction& exact, std::size_t count, std::uint64_t seed,
                       const Progress& progress) {
  Samples samples;
  PointMaker next(domain, seed);
  for (std::size_t i = 0; i < count; ++i) samples.points.push_back(next());
  measureExact(samples, exact, progress);
  return samples;
}

/// A quarter as many, if they are found: uniform points that the field says are near, and the exact distance too.
Samples nearSamples(const Field& field, const DistanceFunction& exact, std::size_t count, std::uint64_t seed,
                    const Progress& progress) {
  const double width = kNear * field.metadata().referenceLength;
  Samples candidates;
  PointMaker next(field.domain(), seed + 1);
  for (std::size_t tries = 0; tries < 100 * count && candidates.points.size() < count / 4; ++tries)
    if (const Vector3 x = next(); std::abs(field.value(x)) <= 1.5 * width) candidates.points.push_back(x);
  measureExact(candidates, exact, progress);
  Samples samples;
  for (std::size_t i = 0; i < candidates.points.size(); ++i) {
    if (std::abs(candidates.exact[i]) > width) continue;
    samples.points.push_back(candidates.points[i]);
    samples.exact.push_back(candidates.exact[i]);
  }
  if (samples.points.empty()) throw Error("no point near the surface was found: take more points");
  return samples;
}

struct Row {
  std::string mesh;
  bool enriched = false;
  double weight = 0;  ///< λ; 0: without weak continuity
  double jump = 0, greatestJump = 0, rms = 0, nearRms = 0;
  std::size_t bytes = 0;
  int iterations = 0;
  double seconds = 0;       ///< of the post-process
  double buildSeconds = 0;  ///< of the construction
};

/// A row and what it is compared with: the mesh's field without enrichment and without weak continuity.
struct Compared {
  const Row& row;
  const Row& first;
  double jump() const { return row.jump / first.jump; }
  double greatestJump() const { return row.greatestJump / first.greatestJump; }
  double rms() const { return row.rms / first.rms; }
  double nearRms() const { return row.nearRms / first.nearRms; }
  double bytes() const { return double(row.bytes) / double(first.bytes); }
  double time() const { return row.seconds / row.buildSeconds; }
};

class ContinuityStudy {
 public:
  ContinuityStudy(Session& session, const Arguments& arguments)
      : console_(session.console()),
        arguments_(arguments),
        count_(static_cast<std::size_t>(arguments.whole("points"))),
        seed_(static_cast<std::uint64_t>(arguments.whole("seed"))) {}

  std::vector<Row> run(const std::string& mesh) {
    std::vector<Row> rows;
    for (const bool enriched : {false, true}) {
      const BuiltField built = buildField(console_, mesh, arguments_, [&](BuildOptions& options) {
        options.enrich = enriched;
        options.continuityWeight = {};
      });
      if (!enriched) takeSamples(built);
      Row row{.mesh = mesh, .enriched = enriched, .buildSeconds = built.seconds};
      measure(built.field, row);
      rows.push_back(row);
      for (const double weight : arguments_.numbers("weights")) {
        const auto start = std::chrono::steady_clock::now();
        const WeaklyContinuous made = withProgress(console_, [&](const Progress& progress) {
          return weaklyContinuous(built.field, {.weight = weight}, arguments_.whole("threads"), progress);
        });
        row.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        row.weight = weight;
        row.iterations = made.iterations;
        measure(made.field, row);
        rows.push_back(row);
      }
    }
    return rows;
  }

 private:
  void takeSamples(const BuiltField& built) {
    withProgress(console_, [&](const Progress& progress) {
      uniform_ = uniformSamples(built.field.domain(), *built.exact, count_, seed_, progress);
      near_ = nearSamples(built.field, *built.exact, count_, seed_, progress);
      return 0;
    });
  }

  void measure(const Field& field, Row& row) const {
    const Jumps jumps = withProgress(
        console_, [&](const Progress& progress) { return findJumps(field, arguments_.whole("threads"), progress); });
    row.jump = jumps.value.rms;
    row.greatestJump = jumps.value.max;
    row.rms = uniform_.rmsError(field);
    row.nearRms = near_.rmsError(field);
    row.bytes = field.bytes();
  }

  const Console& console_;
  const Arguments& arguments_;
  std::size_t count_;
  std::uint64_t seed_;
  Samples uniform_, near_;
};

/// Names of shapes hold commas.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

std::string csv(const std::vector<Compared>& rows) {
  std::string text =
      "mesh,enriched,weight,jump_rms,jump_rms_ratio,jump_max,jump_max_ratio,rms,rms_ratio,near_rms,near_rms_ratio,"
      "bytes,bytes_ratio,iterations,seconds,seconds_ratio\n";
  for (const Compared& of : rows) {
    const Row& row = of.row;
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", quoted(row.mesh), int(row.enriched),
                        row.weight > 0 ? fmt::format("{}", row.weight) : "", row.jump, of.jump(), row.greatestJump,
                        of.greatestJump(), row.rms, of.rms(), row.nearRms, of.nearRms(), row.bytes, of.bytes(),
                        row.iterations, row.seconds, of.time());
  }
  return text;
}

Json json(const std::vector<Compared>& rows) {
  Json all = Json::array();
  for (const Compared& of : rows) {
    const Row& row = of.row;
    all.push_back({{"mesh", row.mesh},
                   {"enriched", row.enriched},
                   {"weight", row.weight > 0 ? Json(row.weight) : Json()},
                   {"jump_rms", row.jump},
                   {"jump_rms_ratio", of.jump()},
                   {"jump_max", row.greatestJump},
                   {"jump_max_ratio", of.greatestJump()},
                   {"rms", row.rms},
                   {"rms_ratio", of.rms()},
                   {"near_rms", row.nearRms},
                   {"near_rms_ratio", of.nearRms()},
                   {"bytes", row.bytes},
                   {"bytes_ratio", of.bytes()},
                   {"iterations", row.iterations},
                   {"seconds", row.seconds},
                   {"build_seconds", row.buildSeconds},
                   {"seconds_ratio", of.time()}});
  }
  return all;
}

std::string table(const std::vector<Compared>& rows) {
  std::string text, mesh;
  for (const Compared& of : rows) {
    const Row& row = of.row;
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
                        row.enriched ? "enriched" : "", row.weight > 0 ? shortNumber(row.weight) : "none", of.jump(),
                        of.greatestJump(), of.rms(), of.nearRms(), of.bytes());
    text += row.weight > 0 ? fmt::format(" {:>6} {:>7.2f} ×\n", row.iterations, of.time()) : "\n";
  }
  return text;
}

}  // namespace

void runContinuityStudy(Session& session, const Arguments& arguments) {
  for (const char* own : {"enrich", "continuity", "continuity-weight"})
    if (arguments.given(own)) throw Error(fmt::format("the study varies {} itself: leave it out", own));
  const bool writes = arguments.has("output");
  if (writes) checkWritable(arguments.text("output"));
  ContinuityStudy study(session, arguments);
  std::vector<std::vector<Row>> meshes;
  for (const std::string& mesh : arguments.texts("mesh")) meshes.push_back(study.run(mesh));
  std::vector<Compared> rows;
  for (const auto& ofMesh : meshes)
    for (const Row& row : ofMesh) rows.push_back({row, ofMesh.front()});
  if (writes) writeTextFile(arguments.text("output"), csv(rows));
  if (session.wantsJson(arguments)) return printJson(session.console().out, json(rows));
  session.console().out << table(rows);
}

std::vector<Parameter> continuityStudyParameters() {
  std::vector<std::size_t> counts;
  for (std::size_t count = 1; count <= 32; ++count) counts.push_back(count);
  return {{.name = "points",
           .type = ParameterType::wholeNumber,
           .help = "Where the error is measured: uniform in the domain, and a quarter as many again near the surface.",
           .defaultText = "200000",
           .minimum = 1000,
           .maximum = 100000000},
          {.name = "seed",
           .type = ParameterType::wholeNumber,
           .help = "Of the points; the same seed, the same points.",
           .defaultText = "1",
           .minimum = 0},
          {.name = "weights",
           .type = ParameterType::numbers,
           .help = "λ of weak continuity, one row each.",
           .defaultText = "30,10,2.5,1,0.4,0.1,0.03",
           .valueName = "λ,λ,…",
           .minimum = 0,
           .minimumExcluded = true,
           .counts = counts}};
}

void addStudyCommand(Registry& registry) {
  Command command{
      .name = "study",
      .summary = "Measure what a setting trades, as a table.",
      .help =
          "study continuity: the trade of weak continuity. Each mesh is built twice, as the options say and with every "
          "degree one higher at the end, and each field is smoothed with each weight. For each: the RMS jump and the "
          "greatest between cells, the measured RMS error over the domain and near the surface (within a hundredth of "
          "the longest side), bytes, the solver's steps, and its time over the construction's. Ratios are over the "
          "mesh's field that was neither enriched nor smoothed.\n"
          "\n"
          "With -o, all figures as CSV.",
      .examples = {"hpsdf study continuity bunny.obj --target-error 1e-5",
                   "hpsdf study continuity builtin:torus --weights 10,1,0.1 --points 50000 -o torus.csv"},
      .parameters =
          {{.name = "kind",
            .type = ParameterType::choice,
            .help = "What to study.",
            .valueName = "KIND",
            .choices = {"continuity"},
            .positional = true,
            .need = Need::always},
           {.name = "mesh",
            .type = ParameterType::text,
            .help = "Mesh files, builtin:SHAPE or analytic:SHAPE.",
            .valueName = "MESH",
            .positional = true,
            .repeatable = true,
            .need = Need::always},
           {.name = "output", .type = ParameterType::outputPath, .help = "CSV file of all figures.", .alias = 'o'}},
      .action = runContinuityStudy};
  for (Parameter& parameter : continuityStudyParameters()) command.parameters.push_back(std::move(parameter));
  for (Parameter& parameter : buildParameters()) command.parameters.push_back(std::move(parameter));
  registry.add(std::move(command));
}

}  // namespace hpsdf::app
