// `study convergence`: error over the number of coefficients, for hp-refinement and for octrees of constant degree
// (paper, Figs. 3 and 4).

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "construction/build_field.h"
#include "files/other_program.h"
#include "files/output_folder.h"
#include "files/svg_chart.h"
#include "files/text_file.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/verify.h"
#include "language/script.h"
#include "session/field_summary.h"
#include "session/session.h"
#include "study/study_command.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

/// Thrown to end a construction when its field has enough coefficients.
struct LargeEnough {};

/// Returns the numbers of construction steps after which the field is inspected: 0, then a geometric sequence with the
/// ratio `growth`. Not every inspection adds a point to the curve, because the number of coefficients that a step adds
/// varies.
std::vector<std::uint64_t> stageSteps(double growth, std::size_t mostCoefficients) {
  const double most =
      double(mostCoefficients) / double(coefficientCount(3) - coefficientCount(2));  // fewest coefficients a step adds
  std::vector<std::uint64_t> steps = {0};
  for (double wanted = 1; wanted <= most; wanted *= growth)
    if (const auto whole = static_cast<std::uint64_t>(std::llround(wanted)); whole > steps.back())
      steps.push_back(whole);
  return steps;
}

/// Measures a field during its construction. Errors are converted to a scale at which the longest side of the mesh is
/// 2.
Json stageOf(const Field& field, const ExactSamples& samples, int threads) {
  const double scale = field.metadata().referenceLength / 2;
  const FieldStatistics figures = statistics(field);
  const ErrorFigures error = measureError(field, samples, threads);
  return {
      {"steps", *field.metadata().steps},     {"leaves", figures.leaves},
      {"coefficients", figures.coefficients}, {"estimated_rms", field.metadata().rmsEstimate(field.domain()) / scale},
      {"measured_rms", error.rms / scale},    {"measured_max", error.max / scale}};
}

/// Builds a field by this refinement strategy. Returns measurements of the field at several stages of its construction,
/// in ascending order of the number of coefficients.
Json curveOf(const BuildInput& input, Strategy strategy, const ExactSamples& samples, const Arguments& arguments,
             const Progress& progress) {
  const double growth = std::pow(10, 1 / arguments.number("stages"));
  const auto most = static_cast<std::size_t>(arguments.number("max-coefficients"));
  BuildOptions options = input.options;
  options.strategy = strategy;
  options.coefficients = CoefficientType::float64;
  // The number of coefficients ends the construction: there is no target error, and no default limit of the memory
  // for want of one.
  options.targetError = 0;
  if (!arguments.given("memory-limit")) options.memoryLimit.reset();
  Json stages = Json::array();
  const auto inspect = [&](const Field& field) {
    const std::size_t coefficients = statistics(field).coefficients;
    if (coefficients > most) throw LargeEnough();
    if (!stages.empty() && double(coefficients) < growth * numberIn(stages.back(), "coefficients")) return;
    stages.push_back(stageOf(field, samples, options.threads));
    if (progress.report)
      progress.report(strategyName(strategy), std::log(double(coefficients)) / std::log(double(most)));
  };
  try {
    buildStages(*input.exact, input.domain, options, stageSteps(std::pow(growth, 0.25), most), inspect,
                {.report = {}, .cancelled = progress.cancelled});
  } catch (const LargeEnough&) {
  }
  if (stages.empty())
    throw Error(
        fmt::format("max-coefficients: the base cells of {} alone have more; give a larger number or a smaller "
                    "grid",
                    strategyName(strategy)));
  return stages;
}

/// Returns the smallest measured RMS error that all curves reach.
double commonRms(const Json& curves) {
  double common = 0;
  for (const Json& stages : curves) {
    double least = std::numeric_limits<double>::infinity();
    for (const Json& stage : stages) least = std::min(least, numberIn(stage, "measured_rms"));
    common = std::max(common, least);
  }
  return common;
}

/// Returns the number of coefficients at which a curve reaches the measured RMS error `rms`, by linear interpolation of
/// the logarithms. Returns std::nullopt if the curve does not reach this error or starts below it.
std::optional<double> coefficientsAt(const Json& stages, double rms) {
  for (std::size_t n = 0; n < stages.size(); ++n) {
    const double rmsAfter = numberIn(stages[n], "measured_rms"), after = numberIn(stages[n], "coefficients");
    if (rmsAfter > rms) continue;
    if (rmsAfter == rms) return after;
    if (n == 0) return std::nullopt;
    const double rmsBefore = numberIn(stages[n - 1], "measured_rms"), before = numberIn(stages[n - 1], "coefficients");
    const double share = std::log(rms / rmsBefore) / std::log(rmsAfter / rmsBefore);
    return std::exp(std::lerp(std::log(before), std::log(after), share));
  }
  return std::nullopt;
}

/// Returns, for each curve, the number of coefficients at which the curve reaches the RMS error `rms`.
Json equalError(const Json& curves, double rms) {
  Json json = {{"measured_rms", rms}};
  const auto ofHp = coefficientsAt(curves.front(), rms);
  for (const auto& [strategy, stages] : curves.items()) {
    const auto coefficients = coefficientsAt(stages, rms);
    json[strategy] = {{"coefficients", coefficients ? Json(*coefficients) : Json()},
                      {"over_hp", coefficients && ofHp ? Json(*coefficients / *ofHp) : Json()}};
  }
  return json;
}

/// Returns the convergence curves of one mesh and the comparison of these curves. `name` stands for the mesh in
/// file names.
Json studied(Session& session, const Arguments& arguments, std::size_t mesh, const std::string& name) {
  const std::string surface = arguments.texts("mesh")[mesh];
  const Arguments ofBuild = buildArguments(session, arguments, mesh);
  const BuildInput input = buildInput(session.console(), surface, ofBuild);
  const ExactSamples samples =
      exactSamples(session.console(), arguments, *input.exact, input.domain, input.options.threads);
  return withProgress(session.console(), [&](const Progress& progress) {
    Json curves = Json::object();
    for (const Strategy strategy : {Strategy::hp, Strategy::h2, Strategy::h1})
      curves[strategyName(strategy)] =
          withinMemory(ofBuild, [&] { return curveOf(input, strategy, samples, arguments, progress); });
    const double rms = arguments.has("at") ? arguments.number("at") : commonRms(curves);
    return Json({{"mesh", surface}, {"name", name}, {"equal_error", equalError(curves, rms)}, {"curves", curves}});
  });
}

std::string csvOf(const Json& meshes) {
  std::string text = "mesh,strategy,steps,leaves,coefficients,estimated_rms,measured_rms,measured_max\n";
  for (const Json& mesh : meshes)
    for (const auto& [strategy, stages] : mesh["curves"].items())
      for (const Json& stage : stages)
        text += fmt::format("{},{},{}\n", mesh["name"].get<std::string>(), strategy, rowText(stage));
  return text;
}

std::string textOf(const Json& mesh) {
  std::string text =
      fmt::format("{}\n  {:<9} {:>14} {:>12} {:>17} {:>13} {:>13}\n", mesh["mesh"].get<std::string>(), "strategy",
                  "coefficients", "cells", "weighted estimate", "measured RMS", "measured max");
  for (const auto& [strategy, stages] : mesh["curves"].items()) {
    const Json& last = stages.back();
    text += fmt::format("  {:<9} {:>14} {:>12} {:>17} {:>13} {:>13}\n", strategy,
                        grouped(last["coefficients"].get<std::uint64_t>()),
                        grouped(last["leaves"].get<std::uint64_t>()), shortNumber(numberIn(last, "estimated_rms")),
                        shortNumber(numberIn(last, "measured_rms")), shortNumber(numberIn(last, "measured_max")));
  }
  const Json& equal = mesh["equal_error"];
  text += fmt::format("  coefficients at a measured RMS error of {}\n", shortNumber(numberIn(equal, "measured_rms")));
  for (const auto& [strategy, stages] : mesh["curves"].items()) {
    const Json &coefficients = equal[strategy]["coefficients"], &overHp = equal[strategy]["over_hp"];
    text += fmt::format(
        "  {:<9} {:>14}{}\n", strategy,
        coefficients.is_null() ? "out of reach" : grouped(std::uint64_t(std::llround(coefficients.get<double>()))),
        overHp.is_null() ? "" : fmt::format("   {:.2f} × hp", overHp.get<double>()));
  }
  return text;
}

/// Returns the chart of the measured errors of a mesh, for papers.
Chart convergenceChart(const Json& mesh) {
  Chart chart{.xLabel = "coefficients",
              .yLabel = "error, where the longest side is 2",
              .solid = "measured RMS",
              .dashed = "measured maximum"};
  for (const auto& [strategy, stages] : mesh["curves"].items()) {
    ChartCurve rms{.name = strategy, .color = curveColor(chart.curves.size() / 2)}, greatest = rms;
    greatest.dashed = true;
    for (const Json& stage : stages) {
      const double coefficients = numberIn(stage, "coefficients");
      rms.points.push_back({coefficients, numberIn(stage, "measured_rms")});
      greatest.points.push_back({coefficients, numberIn(stage, "measured_max")});
    }
    chart.curves.push_back(std::move(rms));
    chart.curves.push_back(std::move(greatest));
  }
  return chart;
}

/// Returns the gnuplot script that draws the curves of a mesh. The data of the n-th curve are the n-th block of
/// the file plot.dat.
std::string plotScript(const Json& mesh) {
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
      mesh["name"].get<std::string>());
  const std::array<std::array<std::string_view, 3>, 3> kinds = {
      {{"5", "measured RMS", "with linespoints lw 2 pt 7 ps 0.6"},
       {"4", "weighted estimate", "with lines lw 1.5 dt (8,5)"},
       {"6", "measured maximum", "with lines lw 2 dt (2,3)"}}};
  std::string separator;
  std::size_t n = 0;
  for (const auto& [strategy, stages] : mesh["curves"].items()) {
    for (const auto& [column, what, style] : kinds) {
      script += fmt::format("{}\"plot.dat\" index {} using 3:{} {} lc rgb \"{}\" title \"{}, {}\"", separator, n,
                            column, style, curveColor(n), strategy, what);
      separator = ", \\\n     ";
    }
    ++n;
  }
  return script + "\n";
}

/// Draws the curves of a mesh. Returns the bytes of the PNG file.
std::string plotOf(const fs::path& gnuplot, const Json& mesh) {
  const TemporaryFolder folder;
  std::string data;
  for (const Json& stages : mesh["curves"]) {
    for (const Json& stage : stages) data += rowText(stage, " ") + "\n";
    data += "\n\n";
  }
  writeTextFile(folder.path() / "plot.dat", data);
  writeTextFile(folder.path() / "plot.gp", plotScript(mesh));
  const std::string problem = runOtherProgram(gnuplot, {"plot.gp"}, folder.path(), "plot.png", {});
  if (!problem.empty()) throw Error(fmt::format("study convergence: {}; give --no-plot", problem));
  return readWholeFile((folder.path() / "plot.png").string());
}

void runConvergence(Session& session, const Arguments& arguments) {
  const bool plots = !arguments.flag("no-plot");
  const fs::path gnuplot = findProgram("gnuplot").value_or("");
  if (plots && gnuplot.empty())
    throw Error(
        "study convergence: its pictures take the program gnuplot, which PATH does not have; install the package "
        "gnuplot-nox, or give --no-plot");
  OutputFolder folder(arguments.text("output"));
  checkWritable(folder.path() / "convergence.csv");
  const std::vector<std::string> names = checkedNames(session, arguments);
  Json meshes = Json::array();
  std::vector<std::string> pictures;
  for (std::size_t n = 0; n < names.size(); ++n) {
    meshes.push_back(studied(session, arguments, n, names[n]));
    if (plots) pictures.push_back(plotOf(gnuplot, meshes.back()));
  }

  Json files = Json::array();
  const InterruptGuard guard;  // on Ctrl-C, all files are written or none
  const auto write = [&](const std::string& file, const std::string& bytes) {
    folder.write(file, bytes);
    files.push_back((folder.path() / file).string());
  };
  write("convergence.csv", csvOf(meshes));
  for (std::size_t n = 0; n < pictures.size(); ++n) {
    const std::string name = "convergence-" + names[n];
    write(name + ".png", pictures[n]);
    for (const std::string& file : writeChart(folder, name, convergenceChart(meshes[n])))
      files.push_back((folder.path() / file).string());
  }
  files.push_back((folder.path() / "convergence.json").string());
  const Json json = {{"points", static_cast<std::uint64_t>(arguments.number("points"))},
                     {"seed", static_cast<std::uint64_t>(arguments.number("seed"))},
                     {"files", files},
                     {"meshes", meshes}};
  folder.write("convergence.json", jsonText(json));
  folder.commit();
  if (session.wantsJson(arguments)) return printJson(session.console().out, json);
  for (const Json& mesh : meshes) session.console().out << textOf(mesh);
  for (const Json& file : files) session.console().out << file.get<std::string>() << "\n";
}

/// Returns the parameters of `build` that apply to convergence studies. The default of `nearness` is 0, because the
/// paper's curves show unweighted errors.
std::vector<Parameter> unweightedBuildParameters() {
  using Ending = BuildSetting::Ending;
  std::vector<std::string> left = endParametersAndTheirs(
      {Ending::target, Ending::byDistance, Ending::tolerance, Ending::otherQuantity, Ending::steps});
  // The criterion decides what is taken back at the end of a construction, which the curves do not show.
  left.insert(left.end(), {"strategy", "coefficients", "criterion", "band", "bounds", "paper"});
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
curve from one construction. The weighted estimate of the construction stands beside RMS error and maximum measured at
random points, whose exact distances are taken once. Errors are at the scale where the mesh's longest side is 2. Writes
convergence.csv, convergence.json and, with gnuplot, a picture of each mesh, also for papers as .svg and .pdf; tells how many coefficients each strategy
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
