#include "commands/verify_command.h"

// verify: how wrong a field is, measured; with thresholds it is a gate.

#include <fmt/format.h>

#include <filesystem>

#include "console/failed.h"
#include "console/long_work.h"
#include "construction/building.h"
#include "explorer/view_state.h"
#include "files/text_file.h"
#include "hpsdf/detail/face_steps.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/verify.h"
#include "language/script.h"
#include "session/field_argument.h"
#include "session/field_surface.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

struct Verified {
  std::string field;
  std::string surface;
  VerifyOptions options;
  Verification figures;
  const Jumps& jumps;
  FaceSteps steps;
  double diagonal;  ///< of the domain
};

/// A figure that may be limited by an option.
struct Threshold {
  const char* option;
  const char* figure;
  const char* help;
  bool counts;
  double (*value)(const Verified&);
};

const std::vector<Threshold>& thresholds() {
  static const std::vector<Threshold> list = {
      {"max-rms", "the RMS error over uniform points", "RMS error over uniform points.", false,
       [](const Verified& v) { return v.figures.uniform.error.rms; }},
      {"max-near-rms", "the RMS error near the surface", "RMS error over points near the surface.", false,
       [](const Verified& v) { return v.figures.nearSurface.error.rms; }},
      {"max-error", "the greatest error", "Greatest error of all points.", false,
       [](const Verified& v) { return std::max(v.figures.uniform.error.max, v.figures.nearSurface.error.max); }},
      {"max-violations", "the number of points beyond their cell's bound",
       "Number of points at which the error or the slope is beyond the bound that the field keeps for their cell.",
       true, [](const Verified& v) { return double(v.figures.bounds->violations); }},
      {"max-mismatches", "the number of wrong signs beyond the sign bound",
       "Number of points farther from the surface than the sign bound at which the field has the wrong sign.", true,
       [](const Verified& v) {
         return double(v.figures.uniform.signs.beyondCount + v.figures.nearSurface.signs.beyondCount);
       }},
      {"max-angle", "the angle between gradients near the surface",
       "Angle in degrees between the gradients that 99 % of the points near the surface do not exceed.", false,
       [](const Verified& v) { return v.figures.nearSurface.gradient.angle99Degrees; }},
      {"max-slope", "the greatest slope", "Greatest length of the gradient: beyond 1, sphere tracing may step too far.",
       false,
       [](const Verified& v) {
         return std::max(v.figures.uniform.gradient.maxLength, v.figures.nearSurface.gradient.maxLength);
       }},
      {"max-jump", "the greatest jump of the value", "Greatest jump of the value between two cells.", false,
       [](const Verified& v) { return v.jumps.value.max; }},
      {"max-step", "the greatest step of the value across a face, of the domain's diagonal,",
       "Greatest step of the value from one side of a face to the other, as a part of the domain's diagonal.", false,
       [](const Verified& v) { return v.steps.value / v.diagonal; }},
      {"max-gradient-step", "the greatest step of the gradient across a face",
       "Greatest step of the gradient from one side of a face to the other.", false,
       [](const Verified& v) { return v.steps.gradient; }},
  };
  return list;
}

struct Judgement {
  const Threshold& threshold;
  double limit;
  double found;

  bool holds() const { return found <= limit; }
};

std::vector<Judgement> judged(const Verified& verified, const Arguments& arguments) {
  std::vector<Judgement> judgements;
  for (const Threshold& threshold : thresholds())
    if (arguments.given(threshold.option))
      judgements.push_back({threshold, arguments.number(threshold.option), threshold.value(verified)});
  return judgements;
}

std::string exceeded(const std::vector<Judgement>& judgements) {
  std::string text;
  for (const Judgement& judgement : judgements)
    if (!judgement.holds())
      text += fmt::format("{}{} is {}, above {}={}", text.empty() ? "" : "; ", judgement.threshold.figure,
                          shortNumber(judgement.found), judgement.threshold.option, shortNumber(judgement.limit));
  return text;
}

// as JSON

Json errorJson(const ErrorFigures& error) {
  Json percentiles = Json::object();
  for (const auto& [percent, value] : error.percentiles) percentiles[fmt::format("{}", percent)] = value;
  return {{"rms", error.rms}, {"mean", error.mean}, {"max", error.max}, {"percentiles", percentiles}};
}

Json sampleJson(const SampleFigures& figures) {
  const auto& [error, signs, gradient] = figures;
  return {{"points", error.samples},
          {"error", errorJson(error)},
          {"signs",
           {{"mismatches", signs.mismatches},
            {"deepest", signs.deepest},
            {"bound", signs.beyond},
            {"beyond_bound", signs.beyondCount}}},
          {"gradient",
           {{"mean_length", gradient.meanLength},
            {"length_error_rms", gradient.lengthErrorRms},
            {"max_length", gradient.maxLength},
            {"angle_points", gradient.angles},
            {"mean_angle", gradient.meanAngleDegrees},
            {"angle_99", gradient.angle99Degrees},
            {"max_angle", gradient.maxAngleDegrees},
            {"max_pair_slope", gradient.maxPairSlope}}}};
}

Json boundsJson(const std::optional<BoundFigures>& bounds) {
  if (!bounds) return {};
  return {{"violations", bounds->violations},
          {"cells", bounds->cells},
          {"median_bound", bounds->medianBound},
          {"median_worst", bounds->medianWorst}};
}

Json worstJson(const WorstPoint& at) {
  return {{"position", vectorJson(at.point)},
          {"exact", at.exact},
          {"value", at.value},
          {"error", at.value - at.exact},
          {"cell", at.cell},
          {"degree", at.degree},
          {"depth", at.depth}};
}

Json verifiedJson(const Verified& verified, const std::vector<Judgement>& judgements) {
  Json worst = Json::array(), limits = Json::array();
  for (const WorstPoint& at : verified.figures.worst) worst.push_back(worstJson(at));
  for (const Judgement& judgement : judgements)
    limits.push_back({{"option", judgement.threshold.option},
                      {"limit", judgement.limit},
                      {"found", judgement.found},
                      {"holds", judgement.holds()}});
  return {{"field", verified.field},
          {"mesh", verified.surface},
          {"seed", verified.options.seed},
          {"near", verified.figures.near},
          {"band", verified.options.band},
          {"uniform", sampleJson(verified.figures.uniform)},
          {"near_surface", sampleJson(verified.figures.nearSurface)},
          {"jumps",
           {{"value_rms", verified.jumps.value.rms},
            {"value_max", verified.jumps.value.max},
            {"gradient_rms", verified.jumps.gradient.rms},
            {"gradient_max", verified.jumps.gradient.max}}},
          {"steps",
           {{"points", verified.steps.points},
            {"value", verified.steps.value},
            {"value_of_diagonal", verified.steps.value / verified.diagonal},
            {"gradient", verified.steps.gradient}}},
          {"bounds", boundsJson(verified.figures.bounds)},
          {"worst", worst},
          {"thresholds", limits}};
}

// as text

std::string tableRow(const std::string& label, const std::string& uniform, const std::string& near) {
  return fmt::format("  {:<34} {:>14} {:>18}\n", label, uniform, near);
}

std::string figureTable(const Verification& figures) {
  const auto row = [&](const std::string& label, auto figure) {
    return tableRow(label, shortNumber(figure(figures.uniform)), shortNumber(figure(figures.nearSurface)));
  };
  const auto countRow = [&](const std::string& label, auto figure) {
    return tableRow(label, grouped(figure(figures.uniform)), grouped(figure(figures.nearSurface)));
  };
  using F = const SampleFigures&;
  std::string text = "\n" + tableRow("", "uniform", "near the surface");
  text += countRow("points", [](F f) { return f.error.samples; });
  text += row("RMS error", [](F f) { return f.error.rms; });
  text += row("mean error", [](F f) { return f.error.mean; });
  for (const auto& [percent, unused] : figures.uniform.error.percentiles)
    text += row(fmt::format("{} % of the errors are within", percent),
                [at = percent](F f) { return f.error.percentiles.at(at); });
  text += row("greatest error", [](F f) { return f.error.max; });
  text += countRow("wrong signs", [](F f) { return f.signs.mismatches; });
  text += row("  the farthest from the surface", [](F f) { return f.signs.deepest; });
  text += countRow(fmt::format("  farther than {}", shortNumber(figures.uniform.signs.beyond)),
                   [](F f) { return f.signs.beyondCount; });
  text += row("angle of gradients, mean [degrees]", [](F f) { return f.gradient.meanAngleDegrees; });
  text += row("  99 % are within", [](F f) { return f.gradient.angle99Degrees; });
  text += row("  greatest", [](F f) { return f.gradient.maxAngleDegrees; });
  text += row("length of the gradient, mean", [](F f) { return f.gradient.meanLength; });
  text += row("  RMS difference from 1", [](F f) { return f.gradient.lengthErrorRms; });
  text += row("greatest slope, by gradients", [](F f) { return f.gradient.maxLength; });
  text += row("  between neighbouring points", [](F f) { return f.gradient.maxPairSlope; });
  return text;
}

std::string worstText(const std::vector<WorstPoint>& worst) {
  if (worst.empty()) return {};
  std::string text = fmt::format("\n  {:>4} {:>10} {:>12} {:>12}  {:<36} {:>6} {:>5}  {}\n", "", "error", "exact",
                                 "field", "at", "degree", "depth", "cell");
  int rank = 0;
  for (const WorstPoint& at : worst)
    text += fmt::format("  {:>4} {:>10} {:>12.5g} {:>12.5g}  {:<36} {:>6} {:>5}  {}\n", ++rank, shortNumber(at.error()),
                        at.exact, at.value, vectorText(at.point), at.degree, at.depth, at.cell);
  return text;
}

std::string verifiedText(const Verified& verified) {
  const Verification& figures = verified.figures;
  std::string text = fmt::format("{} against {}\n", verified.field, verified.surface);
  const std::string where = verified.options.band > 0
                                ? fmt::format("uniform within {} of the surface", shortNumber(verified.options.band))
                                : "uniform in the domain";
  text += fmt::format("  points {}, and within {} of points on the surface; seed {}\n", where,
                      shortNumber(figures.near), verified.options.seed);
  text += figureTable(figures);
  text += fmt::format("  {:<34} RMS {}, greatest {}; of the gradient RMS {}, greatest {}\n",
                      "jumps of the value between cells", shortNumber(verified.jumps.value.rms),
                      shortNumber(verified.jumps.value.max), shortNumber(verified.jumps.gradient.rms),
                      shortNumber(verified.jumps.gradient.max));
  const FaceSteps& steps = verified.steps;
  text += fmt::format("  {:<34} of the value {} ({} of the domain's diagonal), of the gradient {}; {} points\n",
                      "greatest steps across faces", shortNumber(steps.value),
                      shortNumber(steps.value / verified.diagonal), shortNumber(steps.gradient), grouped(steps.points));
  if (figures.uniform.signs.mismatches + figures.nearSurface.signs.mismatches > 0)
    text += fmt::format(
        "  a sign must be wrong between the surface and the field's own zero; farther away than {} it is a defect\n",
        shortNumber(figures.uniform.signs.beyond));
  if (const auto& bounds = figures.bounds)
    text += fmt::format("bounds: {} in the median of {} cells, where the worst point's error is {}; {}\n",
                        shortNumber(bounds->medianBound), grouped(bounds->cells), shortNumber(bounds->medianWorst),
                        bounds->violations == 0 ? std::string("no point is beyond its bound")
                                                : fmt::format("{} points are BEYOND", grouped(bounds->violations)));
  return text + worstText(figures.worst);
}

/// Lines that take the explorer to each of the worst points, and a picture of each.
std::string worstScript(const Session& session, const Verified& verified, const std::filesystem::path& file) {
  const bool loaded = session.current().fileBytes.has_value();
  std::string text =
      fmt::format("# The worst points of {} against {}, worst first.\n", verified.field, verified.surface);
  text += loaded ? fmt::format("load {}\n", scriptWord(verified.field))
                 : "# to be included where that field is the current one\n";
  text += fmt::format("show slice\ncolor error mesh={}\n", scriptWord(verified.surface));
  int rank = 0;
  for (const WorstPoint& at : verified.figures.worst) {
    text += fmt::format("# {}: error {}, degree {}, depth {}\n", ++rank, shortNumber(at.error()), at.degree, at.depth);
    text += fmt::format("fly to={},{},{}\nshot output={}\n", at.point.x(), at.point.y(), at.point.z(),
                        scriptWord(fmt::format("{}-{}.png", file.stem().string(), rank)));
  }
  return text;
}

VerifyOptions verifyOptions(const Arguments& arguments) {
  return {.points = static_cast<std::size_t>(arguments.number("points")),
          .seed = static_cast<std::uint64_t>(arguments.number("seed")),
          .near = arguments.has("near") ? arguments.number("near") : 0,
          .band = arguments.has("band") ? arguments.number("band") : 0,
          .signBound = arguments.has("sign-bound") ? arguments.number("sign-bound") : 0,
          .worst = static_cast<std::size_t>(arguments.whole("worst")),
          .threads = arguments.whole("threads")};
}

void runVerify(Session& session, const Arguments& arguments) {
  const bool writes = arguments.has("script");
  if (writes) checkWritable(arguments.text("script"));
  useField(session, arguments);
  const CurrentField& current = session.current();
  if (arguments.given("max-violations") && current.field.data().bounds.empty())
    throw Error(fmt::format("max-violations: {} keeps no bounds: build it with --bounds", current.name));
  const std::string surface = surfaceFor(session.current(), arguments);
  const ReferenceSurface reference = referenceSurface(session.console(), surface, current.field.metadata().source);
  if (!arguments.flag("any-mesh"))
    refuseForeign(current, reference, surface, ", or --any-mesh to compare them all the same");
  const VerifyOptions options = verifyOptions(arguments);
  Verification figures = withProgress(session.console(), [&](const Progress& progress) {
    return verify(current.field, {*reference.distance, reference.normal, reference.mesh}, options, progress);
  });
  const Jumps& jumps = session.jumps();
  const FaceSteps steps = withProgress(session.console(), [&](const Progress& progress) {
    return stepsAcrossFaces(current.field, jumps.interfaces, options.points, options.seed, options.threads, progress);
  });
  const Verified verified{
      current.name, surface, options, std::move(figures), jumps, steps, current.field.domain().diagonal().norm()};
  const std::vector<Judgement> judgements = judged(verified, arguments);
  if (writes) {
    const std::string file = arguments.text("script");
    writeTextFile(file, worstScript(session, verified, file));
  }
  if (session.wantsJson(arguments))
    printJson(session.console().out, verifiedJson(verified, judgements));
  else
    session.console().out << verifiedText(verified);
  if (const std::string problem = exceeded(judgements); !problem.empty())
    throw Failed(fmt::format("{}: {}", current.name, problem));
}

}  // namespace

void addVerifyCommand(Registry& registry) {
  Command command{
      .name = "verify",
      .summary = "Measure how wrong a field is, and fail where it is worse than allowed.",
      .help =
          "Random points, half of them uniform in the domain, half near the surface, with the field's value and the "
          "exact distance of MESH: RMS, mean, percentiles and maximum of the difference; wrong signs; the angle "
          "between the gradients and the length of the field's; slopes; the jumps between cells; as many random points "
          "of faces again, with what queries answer on "
          "either side; and the worst points, one of each cell. The same seed gives the same figures, whatever the "
          "number of threads. Lengths are in the "
          "field's units.\n"
          "\n"
          "Between the surface and the field's own zero signs are wrong by necessity. Only those farther from the "
          "surface than the sign bound are a defect, and count for max-mismatches.\n"
          "\n"
          "Each --max-… is a threshold: when one is exceeded, all figures are written, the last line says which, and "
          "the exit status is 1. MESH may be left out where the field was made from a built-in shape. A mesh that the "
          "field was not made from is refused.",
      .examples = {"hpsdf verify bunny.hpsdf bunny.obj",
                   "hpsdf verify bunny.hpsdf bunny.obj --max-rms 5e-4 --max-error 0.02 --max-mismatches 0",
                   "hpsdf verify torus.hpsdf --points 1e7 --band 0.05 --json",
                   "hpsdf verify bunny.hpsdf bunny.obj --worst 5 --script worst.hps"},
      .parameters =
          {fieldParameter(),
           {.name = "mesh",
            .type = ParameterType::text,
            .help = "What the field was made from: mesh file, builtin:SHAPE or analytic:SHAPE.",
            .valueName = "MESH",
            .positional = true},
           pointsParameter("How many points, of both kinds together.", "1000000", 2),
           seedParameter(),
           {.name = "near",
            .type = ParameterType::number,
            .help = "How far from a random point of the surface a near point may lie. When left out, a "
                    "hundredth of the mesh's longest side.",
            .unit = "world units",
            .minimum = 0,
            .minimumExcluded = true},
           {.name = "band",
            .type = ParameterType::number,
            .help = "Look only so near to the surface: uniform points are those of the band.",
            .unit = "world units",
            .minimum = 0,
            .minimumExcluded = true},
           {.name = "sign-bound",
            .type = ParameterType::number,
            .help = "Farther from the surface than this a wrong sign is a defect. When left out, ten times "
                    "the RMS error near the surface.",
            .unit = "world units",
            .minimum = 0,
            .minimumExcluded = true},
           {.name = "worst",
            .type = ParameterType::wholeNumber,
            .help = "How many of the worst points to list.",
            .defaultText = "10",
            .minimum = 0,
            .maximum = 100000},
           {.name = "script",
            .type = ParameterType::outputPath,
            .help = "A script to write, *.hps, which flies the explorer to each of them; to be run from this folder.",
            .valueName = "FILE"},
           {.name = "any-mesh",
            .type = ParameterType::flag,
            .help = "Compare with a mesh that the field was not made from.",
            .defaultText = "false"},
           threadsParameter("The figures are")},
      .action = runVerify};
  for (const Threshold& threshold : thresholds())
    command.parameters.push_back({.name = threshold.option,
                                  .type = threshold.counts ? ParameterType::wholeNumber : ParameterType::number,
                                  .help = fmt::format("Threshold: {}", threshold.help),
                                  .minimum = 0,
                                  .maximum = threshold.counts ? std::optional(1e9) : std::nullopt});
  registry.add(std::move(command));
}

}  // namespace hpsdf::app
