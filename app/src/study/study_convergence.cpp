// `study convergence`: error over the number of coefficients, for hp-refinement and for octrees of constant degree
// (paper, Figs. 3 and 4).

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>

#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "construction/build_field.h"
#include "files/other_program.h"
#include "files/output_folder.h"
#include "files/text_file.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/verify.h"
#include "language/script.h"
#include "session/field_summary.h"
#include "session/session.h"
#include "study/study.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

constexpr std::array kStrategies = {Strategy::hp, Strategy::h2, Strategy::h1};
constexpr std::array kCurveColors = {"#1683ab", "#d1721b", "#6b7280"};

/// The figures of a field during its construction. Errors are scaled to a mesh with a longest side of 2.
struct Stage {
  std::uint64_t steps;
  std::size_t leaves;
  std::size_t coefficients;
  double estimatedRms;
  double measuredRms;
  double measuredMax;
};

struct Curve {
  Strategy strategy;
  std::vector<Stage> stages;  ///< by ascending number of coefficients
};

struct Convergence {
  std::string mesh;
  std::string name;  ///< name for files
  std::vector<Curve> curves;
};

/// Thrown to end a construction that has enough coefficients.
struct LargeEnough {};

/// The numbers of steps at which the field is inspected: 0, then a geometric sequence with the ratio `growth`. Steps
/// add different numbers of coefficients, so that more fields are inspected than become stages.
std::vector<std::uint64_t> stageSteps(double growth, std::size_t mostCoefficients) {
  const double most =
      double(mostCoefficients) / double(coefficientCount(3) - coefficientCount(2));  // the smallest step
  std::vector<std::uint64_t> steps = {0};
  for (double wanted = 1; wanted <= most; wanted *= growth)
    if (const auto whole = static_cast<std::uint64_t>(std::llround(wanted)); whole > steps.back())
      steps.push_back(whole);
  return steps;
}

Stage stageOf(const Field& field, const ExactSamples& samples, int threads) {
  const double scale = field.metadata().referenceLength / 2;
  const FieldStatistics figures = statistics(field);
  const ErrorFigures error = measureError(field, samples, threads);
  return {*field.metadata().steps, figures.leaves,
          figures.coefficients,    field.metadata().rmsEstimate(field.domain()) / scale,
          error.rms / scale,       error.max / scale};
}

Curve curveOf(const BuildInput& input, Strategy strategy, const ExactSamples& samples, const Arguments& arguments,
              const Progress& progress) {
  const double growth = std::pow(10, 1 / arguments.number("stages"));
  const auto most = static_cast<std::size_t>(arguments.number("max-coefficients"));
  BuildOptions options = input.options;
  options.strategy = strategy;
  options.coefficients = CoefficientType::float64;
  options.targetError = std::numeric_limits<double>::min();  // the construction refines until it is ended
  Curve curve{strategy, {}};
  try {
    buildStages(*input.exact, input.domain, options, stageSteps(std::pow(growth, 0.25), most),
                [&](const Field& field) {
                  const std::size_t coefficients = statistics(field).coefficients;
                  if (coefficients > most) throw LargeEnough();
                  if (!curve.stages.empty() && double(coefficients) < growth * double(curve.stages.back().coefficients))
                    return;
                  curve.stages.push_back(stageOf(field, samples, options.threads));
                  if (progress.report)
                    progress.report(strategyName(strategy), std::log(double(coefficients)) / std::log(double(most)));
                },
                {.report = {}, .cancelled = progress.cancelled});
  } catch (const LargeEnough&) {
  }
  if (curve.stages.empty())
    throw Error(
        fmt::format("max-coefficients: the base cells of {} alone have more; give a larger number or a smaller "
                    "grid",
                    strategyName(strategy)));
  return curve;
}

Convergence studied(Session& session, const Arguments& arguments, std::size_t mesh, const std::string& name) {
  const std::string surface = arguments.texts("mesh")[mesh];
  const BuildInput input = buildInput(session.console(), surface, buildArguments(session, arguments, mesh));
  return withProgress(session.console(), [&](const Progress& progress) {
    const SampleOptions sampling = sampleOptions(arguments, input.options.threads);
    const ExactSamples samples = sampleUniform(*input.exact, input.domain, 0, sampling, progress);
    Convergence convergence{surface, name, {}};
    for (const Strategy strategy : kStrategies)
      convergence.curves.push_back(curveOf(input, strategy, samples, arguments, progress));
    return convergence;
  });
}

/// The smallest measured RMS error that all curves reach.
double commonRms(const Convergence& convergence) {
  double common = 0;
  for (const Curve& curve : convergence.curves)
    common = std::max(common, std::ranges::min(curve.stages, {}, &Stage::measuredRms).measuredRms);
  return common;
}

/// The number of coefficients at which a curve has a measured RMS error, interpolated linearly in logarithms. Nothing
/// if the curve does not reach the error, or starts below it.
std::optional<double> coefficientsAt(const Curve& curve, double rms) {
  for (std::size_t n = 0; n < curve.stages.size(); ++n) {
    const Stage& after = curve.stages[n];
    if (after.measuredRms > rms) continue;
    if (after.measuredRms == rms) return double(after.coefficients);
    if (n == 0) return std::nullopt;
    const Stage& before = curve.stages[n - 1];
    const double share = std::log(rms / before.measuredRms) / std::log(after.measuredRms / before.measuredRms);
    return std::exp(std::lerp(std::log(double(before.coefficients)), std::log(double(after.coefficients)), share));
  }
  return std::nullopt;
}

double comparedRms(const Convergence& convergence, const Arguments& arguments) {
  return arguments.has("at") ? arguments.number("at") : commonRms(convergence);
}

std::string csvOf(const std::vector<Convergence>& all) {
  std::string text = "mesh,strategy,steps,leaves,coefficients,estimated_rms,measured_rms,measured_max\n";
  for (const Convergence& convergence : all)
    for (const Curve& curve : convergence.curves)
      for (const Stage& stage : curve.stages)
        text += fmt::format("{},{},{},{},{},{},{},{}\n", convergence.name, strategyName(curve.strategy), stage.steps,
                            stage.leaves, stage.coefficients, stage.estimatedRms, stage.measuredRms, stage.measuredMax);
  return text;
}

Json comparisonJson(const Convergence& convergence, double rms) {
  Json json = {{"measured_rms", rms}};
  const auto ofHp = coefficientsAt(convergence.curves.front(), rms);
  for (const Curve& curve : convergence.curves) {
    const auto coefficients = coefficientsAt(curve, rms);
    json[strategyName(curve.strategy)] = {{"coefficients", coefficients ? Json(*coefficients) : Json()},
                                          {"over_hp", coefficients && ofHp ? Json(*coefficients / *ofHp) : Json()}};
  }
  return json;
}

Json jsonOf(const std::vector<Convergence>& all, const Arguments& arguments, const Json& files) {
  Json meshes = Json::array();
  for (const Convergence& convergence : all) {
    Json curves = Json::object();
    for (const Curve& curve : convergence.curves) {
      Json stages = Json::array();
      for (const Stage& stage : curve.stages)
        stages.push_back({{"steps", stage.steps},
                          {"leaves", stage.leaves},
                          {"coefficients", stage.coefficients},
                          {"estimated_rms", stage.estimatedRms},
                          {"measured_rms", stage.measuredRms},
                          {"measured_max", stage.measuredMax}});
      curves[strategyName(curve.strategy)] = stages;
    }
    meshes.push_back({{"mesh", convergence.mesh},
                      {"name", convergence.name},
                      {"equal_error", comparisonJson(convergence, comparedRms(convergence, arguments))},
                      {"curves", curves}});
  }
  return {{"points", static_cast<std::uint64_t>(arguments.number("points"))},
          {"seed", static_cast<std::uint64_t>(arguments.number("seed"))},
          {"files", files},
          {"meshes", meshes}};
}

std::string textOf(const Convergence& convergence, const Arguments& arguments) {
  std::string text = fmt::format("{}\n  {:<9} {:>14} {:>12} {:>14} {:>13} {:>13}\n", convergence.mesh, "strategy",
                                 "coefficients", "cells", "estimated RMS", "measured RMS", "measured max");
  for (const Curve& curve : convergence.curves) {
    const Stage& last = curve.stages.back();
    text += fmt::format("  {:<9} {:>14} {:>12} {:>14} {:>13} {:>13}\n", strategyName(curve.strategy),
                        grouped(last.coefficients), grouped(last.leaves), shortNumber(last.estimatedRms),
                        shortNumber(last.measuredRms), shortNumber(last.measuredMax));
  }
  const double rms = comparedRms(convergence, arguments);
  text += fmt::format("  coefficients at a measured RMS error of {}\n", shortNumber(rms));
  const auto ofHp = coefficientsAt(convergence.curves.front(), rms);
  for (const Curve& curve : convergence.curves) {
    const auto coefficients = coefficientsAt(curve, rms);
    text += fmt::format("  {:<9} {:>14}", strategyName(curve.strategy),
                        coefficients ? grouped(std::uint64_t(std::llround(*coefficients))) : "out of reach");
    text += coefficients && ofHp ? fmt::format("   {:.2f} × hp\n", *coefficients / *ofHp) : "\n";
  }
  return text;
}

fs::path requireGnuplot() {
  if (const auto found = findProgram("gnuplot")) return *found;
  throw Error(
      "study convergence: its pictures take the program gnuplot, which PATH does not have; install the package "
      "gnuplot-nox, or give --no-plot");
}

/// The gnuplot script that draws a mesh's curves. The data of the n-th curve are the n-th block of plot.dat.
std::string plotScript(const Convergence& convergence) {
  std::string script = fmt::format(
      "set terminal pngcairo size 900,560 font \"DejaVu Sans,11\" background \"#fbfbf8\"\n"
      "set output \"plot.png\"\n"
      "set title \"{}\" noenhanced\n"
      "set logscale xy\n"
      "set autoscale xfixmin\nset autoscale xfixmax\nset autoscale yfixmin\nset autoscale yfixmax\n"
      "set offsets graph 0.03, graph 0.03, graph 0.04, graph 0.04\n"
      "set format x \"10^{{%L}}\"\n"
      "set format y \"10^{{%L}}\"\n"
      "set xlabel \"coefficients\"\n"
      "set ylabel \"error, where the longest side is 2\"\n"
      "set grid lt 1 lw 0.7 lc rgb \"#dcdcd8\"\n"
      "set key outside right top\n"
      "plot ",
      convergence.name);
  const std::array<std::array<std::string_view, 3>, 3> kinds = {
      {{"5", "measured RMS", "with linespoints lw 2 pt 7 ps 0.6"},
       {"4", "estimated RMS", "with lines lw 1.5 dt (8,5)"},
       {"6", "measured maximum", "with lines lw 2 dt (2,3)"}}};
  std::string separator;
  for (std::size_t n = 0; n < convergence.curves.size(); ++n)
    for (const auto& [column, what, style] : kinds) {
      script += fmt::format("{}\"plot.dat\" index {} using 3:{} {} lc rgb \"{}\" title \"{}, {}\"", separator, n,
                            column, style, kCurveColors[n], strategyName(convergence.curves[n].strategy), what);
      separator = ", \\\n     ";
    }
  return script + "\n";
}

std::string plotData(const Convergence& convergence) {
  std::string text;
  for (const Curve& curve : convergence.curves) {
    for (const Stage& stage : curve.stages)
      text += fmt::format("{} {} {} {} {} {}\n", stage.steps, stage.leaves, stage.coefficients, stage.estimatedRms,
                          stage.measuredRms, stage.measuredMax);
    text += "\n\n";
  }
  return text;
}

/// Draws the curves of a mesh. Returns the bytes of the PNG file.
std::string plotOf(const fs::path& gnuplot, const Convergence& convergence) {
  const TemporaryFolder folder;
  writeTextFile(folder.path() / "plot.dat", plotData(convergence));
  writeTextFile(folder.path() / "plot.gp", plotScript(convergence));
  const fs::path log = folder.path() / "gnuplot.txt", picture = folder.path() / "plot.png";
  const int status = runOtherProgram(gnuplot, {"plot.gp"}, folder.path(), log, {});
  if (status != 0 || !fs::exists(picture))
    throw Error(fmt::format("study convergence: gnuplot failed with status {} ({}); give --no-plot", status,
                            lastLine(readTextFile(log.string()))));
  return readWholeFile(picture.string());
}

void runConvergence(Session& session, const Arguments& arguments) {
  const bool plots = !arguments.flag("no-plot");
  const fs::path gnuplot = plots ? requireGnuplot() : fs::path();
  OutputFolder folder(arguments.text("output"));
  checkWritable(folder.path() / "convergence.csv");
  const std::vector<std::string> meshes = arguments.texts("mesh");
  const std::vector<std::string> names = fileNames(meshes);
  for (std::size_t n = 0; n < meshes.size(); ++n)
    buildArguments(session, arguments, n);  // reports mistakes before the long work
  std::vector<Convergence> all;
  std::vector<std::string> pictures;
  for (std::size_t n = 0; n < meshes.size(); ++n) {
    all.push_back(studied(session, arguments, n, names[n]));
    if (plots) pictures.push_back(plotOf(gnuplot, all.back()));
  }

  Json files = Json::array();
  const InterruptGuard guard;  // Ctrl-C must not interrupt the writing of the files
  const auto write = [&](const std::string& file, const std::string& bytes) {
    folder.write(file, bytes);
    files.push_back((folder.path() / file).string());
  };
  write("convergence.csv", csvOf(all));
  for (std::size_t n = 0; n < pictures.size(); ++n) write(fmt::format("convergence-{}.png", names[n]), pictures[n]);
  files.push_back((folder.path() / "convergence.json").string());
  const Json json = jsonOf(all, arguments, files);
  folder.write("convergence.json", json.dump(2) + "\n");
  folder.commit();
  if (session.wantsJson(arguments)) return printJson(session.console().out, json);
  for (const Convergence& convergence : all) session.console().out << textOf(convergence, arguments);
  for (const Json& file : files) session.console().out << file.get<std::string>() << "\n";
}

/// The parameters of `build`, with a nearness of 0, because the paper's curves show unweighted errors.
std::vector<Parameter> unweightedBuildParameters() {
  using Ending = BuildSetting::Ending;
  std::vector<std::string> left =
      endParameters({Ending::target, Ending::byDistance, Ending::otherQuantity, Ending::steps});
  left.insert(left.end(), {"near-distance", "strategy", "coefficients", "band", "bounds", "paper"});
  std::vector<Parameter> parameters = buildParametersWithout(left);
  parameterNamed("nearness", parameters).defaultText = "0";
  return parameters;
}

}  // namespace

Study convergenceStudy() {
  return {
      .name = "convergence",
      .help = paragraphs(R"(
error over the number of coefficients, for hp and for plain octrees of degree 2 and 1 (the paper's Figs. 3 and 4), each
curve from one construction. The estimated RMS error of the construction stands beside RMS error and maximum measured at
random points, whose exact distances are taken once. Errors are at the scale where the mesh's longest side is 2. Writes
convergence.csv, convergence.json and, with gnuplot, a picture of each mesh; tells how many coefficients each strategy
needs for the same measured RMS error.)"),
      .parameters =
          joined({{{"at", number().above(0),
                    "The measured RMS error at which strategies are compared. When left out, the least that all of "
                    "them reach."},
                   {"max-coefficients", wholeNumber().within(100, 4e8).byDefault("1000000"), "Where the curves end."},
                   {"stages", wholeNumber().within(1, 100).byDefault("8"),
                    "How many points of a curve, about, for each factor of ten in the number of coefficients."},
                   {"no-plot", flag(), "Write no pictures: gnuplot is not needed then."}},
                  samplingParameters(),
                  unweightedBuildParameters()}),
      .run = runConvergence,
  };
}

}  // namespace hpsdf::app
