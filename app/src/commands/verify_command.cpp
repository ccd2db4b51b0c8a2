#include <fmt/format.h>

#include <filesystem>

#include "commands/commands.h"
#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "construction/reference_surface.h"
#include "explorer/view_state.h"
#include "files/text_file.h"
#include "hpsdf/app/failed.h"
#include "hpsdf/detail/face_steps.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/verify.h"
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
  JumpTotals jumps;
  FaceSteps steps;
  double diagonal;  ///< length of the domain's diagonal
};

/// A measured figure, such as the RMS error, and the option that sets a limit for it.
struct Threshold {
  const char* option;
  const char* figure;  ///< name of the figure in messages
  const char* help;
  bool counts;  ///< true if the figure is a number of points
  double (*value)(const Verified&);
};

constexpr Threshold kThresholds[] = {
    {"max-rms", "the RMS error over uniform points", "Limits the RMS error over uniform points.", false,
     [](const Verified& v) { return v.figures.uniform.error.rms; }},
    {"max-near-rms", "the RMS error near the surface", "Limits the RMS error over points near the surface.", false,
     [](const Verified& v) { return v.figures.nearSurface.error.rms; }},
    {"max-error", "the greatest error", "Limits the greatest error of all points.", false,
     [](const Verified& v) { return std::max(v.figures.uniform.error.max, v.figures.nearSurface.error.max); }},
    {"max-violations", "the number of points beyond their cell's bound",
     "Limits the number of points at which the error or the slope exceeds the bound of their cell. The field must hold "
     "bounds ('build --bounds').",
     true, [](const Verified& v) { return double(v.figures.bounds->violations); }},
    {"max-mismatches", "the number of wrong signs beyond the sign bound",
     "Limits the number of wrong signs farther from the surface than the sign bound.", true,
     [](const Verified& v) { return double(v.figures.uniform.signs.defects + v.figures.nearSurface.signs.defects); }},
    {"max-angle", "the angle between gradients near the surface",
     "Limits the angle in degrees between the gradients that 99 % of the points near the surface do not exceed.", false,
     [](const Verified& v) { return v.figures.nearSurface.gradient.angle99Degrees; }},
    {"max-slope", "the greatest slope",
     "Limits the greatest length of the gradient. Beyond 1, sphere tracing may step too far.", false,
     [](const Verified& v) {
       return std::max(v.figures.uniform.gradient.maxLength, v.figures.nearSurface.gradient.maxLength);
     }},
    {"max-jump", "the greatest jump of the value", "Limits the greatest jump of the value between two cells.", false,
     [](const Verified& v) { return v.jumps.value.max; }},
    {"max-step", "the greatest step of the value across a face, of the domain's diagonal,",
     "Limits the greatest step of queried values from one side of a face to the other, as a fraction of the domain's "
     "diagonal.",
     false, [](const Verified& v) { return v.steps.value / v.diagonal; }},
    {"max-gradient-step", "the greatest step of the gradient across a face",
     "Limits the greatest step of queried gradients from one side of a face to the other.", false,
     [](const Verified& v) { return v.steps.gradient; }},
};

struct Judgement {
  const Threshold& threshold;
  double limit;
  double found;

  bool holds() const { return found <= limit; }
};

std::vector<Judgement> judged(const Verified& verified, const Arguments& arguments) {
  std::vector<Judgement> judgements;
  for (const Threshold& threshold : kThresholds)
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

Json sampleJson(const SampleFigures& figures) {
  const auto& [error, signs, gradient] = figures;
  Json percentiles = Json::object();
  for (const auto& [percent, value] : error.percentiles) percentiles[fmt::format("{}", percent)] = value;
  return {{"points", error.samples},
          {"error", {{"rms", error.rms}, {"mean", error.mean}, {"max", error.max}, {"percentiles", percentiles}}},
          {"signs",
           {{"mismatches", signs.mismatches},
            {"deepest", signs.farthest},
            {"bound", signs.threshold},
            {"beyond_bound", signs.defects}}},
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

Json boundFiguresJson(const std::optional<BoundFigures>& bounds) {
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
          {"degree", degreeJson(at.degree)},
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
          {"bounds", boundFiguresJson(verified.figures.bounds)},
          {"worst", worst},
          {"thresholds", limits}};
}

/// Returns a table with two columns of figures: one over uniformly distributed points, one over points near
/// the surface.
std::string figureTable(const Verification& figures) {
  std::string text = "\n";
  const auto row = [&](const std::string& label, const std::string& uniform, const std::string& near) {
    text += fmt::format("  {:<34} {:>14} {:>18}\n", label, uniform, near);
  };
  const auto number = [&](const std::string& label, auto figure) {
    row(label, shortNumber(figure(figures.uniform)), shortNumber(figure(figures.nearSurface)));
  };
  const auto count = [&](const std::string& label, auto figure) {
    row(label, grouped(figure(figures.uniform)), grouped(figure(figures.nearSurface)));
  };
  using F = const SampleFigures&;
  row("", "uniform", "near the surface");
  count("points", [](F f) { return f.error.samples; });
  number("RMS error", [](F f) { return f.error.rms; });
  number("mean error", [](F f) { return f.error.mean; });
  for (const auto& [percent, unused] : figures.uniform.error.percentiles)
    number(fmt::format("{} % of the errors are within", percent),
           [at = percent](F f) { return f.error.percentiles.at(at); });
  number("greatest error", [](F f) { return f.error.max; });
  count("wrong signs", [](F f) { return f.signs.mismatches; });
  number("  the farthest from the surface", [](F f) { return f.signs.farthest; });
  count(fmt::format("  farther than {}", shortNumber(figures.uniform.signs.threshold)),
        [](F f) { return f.signs.defects; });
  number("angle of gradients, mean [degrees]", [](F f) { return f.gradient.meanAngleDegrees; });
  number("  99 % are within", [](F f) { return f.gradient.angle99Degrees; });
  number("  greatest", [](F f) { return f.gradient.maxAngleDegrees; });
  number("length of the gradient, mean", [](F f) { return f.gradient.meanLength; });
  number("  RMS difference from 1", [](F f) { return f.gradient.lengthErrorRms; });
  number("greatest slope, by gradients", [](F f) { return f.gradient.maxLength; });
  number("  between neighbouring points", [](F f) { return f.gradient.maxPairSlope; });
  return text;
}

std::string worstText(const std::vector<WorstPoint>& worst) {
  if (worst.empty()) return {};
  std::string text = fmt::format("\n  {:>4} {:>10} {:>12} {:>12}  {:<36} {:>6} {:>5}  {}\n", "", "error", "exact",
                                 "field", "at", "degree", "depth", "cell");
  int rank = 0;
  for (const WorstPoint& at : worst)
    text += fmt::format("  {:>4} {:>10} {:>12.5g} {:>12.5g}  {:<36} {:>6} {:>5}  {}\n", ++rank, shortNumber(at.error()),
                        at.exact, at.value, vectorText(at.point), levelName(at.degree), at.depth, at.cell);
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
        shortNumber(figures.uniform.signs.threshold));
  if (const auto& bounds = figures.bounds)
    text += fmt::format("bounds: {} in the median of {} cells, where the worst point's error is {}; {}\n",
                        shortNumber(bounds->medianBound), grouped(bounds->cells), shortNumber(bounds->medianWorst),
                        bounds->violations == 0 ? std::string("no point is beyond its bound")
                                                : fmt::format("{} points are BEYOND", grouped(bounds->violations)));
  return text + worstText(figures.worst);
}

/// Returns a script that moves the explorer to each of the points with the largest errors and takes a picture there.
std::string worstScript(const Session& session, const Verified& verified, const std::filesystem::path& file) {
  const bool loaded = session.current().fileBytes.has_value();
  std::string text =
      fmt::format("# The worst points of {} against {}, worst first.\n", verified.field, verified.surface);
  text += loaded ? fmt::format("load {}\n", scriptWord(verified.field))
                 : "# Include this script where that field is the current one.\n";
  text += fmt::format("show slice\ncolor error mesh={}\n", scriptWord(verified.surface));
  int rank = 0;
  for (const WorstPoint& at : verified.figures.worst) {
    text += fmt::format("# {}: error {}, degree {}, depth {}\n", ++rank, shortNumber(at.error()), levelName(at.degree),
                        at.depth);
    text += fmt::format("fly to={},{},{}\nshot output={}\n", at.point.x(), at.point.y(), at.point.z(),
                        scriptWord(fmt::format("{}-{}.png", file.stem().string(), rank)));
  }
  return text;
}

VerifyOptions verifyOptions(const Arguments& arguments) {
  const auto numberOrZero = [&](const char* name) { return arguments.has(name) ? arguments.number(name) : 0; };
  return {.points = static_cast<std::size_t>(arguments.number("points")),
          .seed = static_cast<std::uint64_t>(arguments.number("seed")),
          .near = numberOrZero("near"),
          .band = numberOrZero("band"),
          .signBound = numberOrZero("sign-bound"),
          .worst = static_cast<std::size_t>(arguments.whole("worst")),
          .threads = arguments.whole("threads")};
}

void runVerify(Session& session, const Arguments& arguments) {
  const bool writes = arguments.has("script");
  if (writes) checkWritable(arguments.text("script"));
  const std::string surface = useFieldWithSurface(session, arguments);
  const CurrentField& current = session.current();
  if (arguments.given("max-violations") && current.field.data().bounds.empty())
    throw Error(fmt::format("max-violations: {} keeps no bounds: build it with --bounds", current.name));
  const ReferenceSurface reference = referenceSurface(session.console(), surface, current.field.metadata().source);
  if (!arguments.flag("any-mesh")) refuseForeign(current, reference, surface, ", or --any-mesh to compare them anyway");
  const VerifyOptions options = verifyOptions(arguments);
  Verification figures = withProgress(session.console(), [&](const Progress& progress) {
    return verify(current.field, {*reference.distance, reference.normal, reference.mesh}, options, progress);
  });
  const JumpTotals jumps = session.jumpTotals(options.threads);
  const FaceSteps steps = withProgress(session.console(), [&](const Progress& progress) {
    return stepsAcrossFaces(current.field, options.points, options.seed, options.threads, progress);
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

std::vector<Parameter> sampledParameters() {
  return {
      pointsParameter("Number of random points, uniform and near ones counted alike.", "1000000", 2),
      seedParameter(),
      {"near", number().above(0).in("world units"),
       "Greatest distance of a near point from a random point of the surface. When left out, one hundredth of the "
       "mesh's longest side."},
      {"band", number().above(0).in("world units").advanced(),
       "Restricts the uniform points to those within this distance of the surface. Use it for fields that were built "
       "with a band."}};
}

const std::vector<Parameter> kReported = {
    {"sign-bound", number().above(0).in("world units").under("Limits"),
     "Distance from the surface beyond which a wrong sign is a defect. When left out, ten times the RMS error near the "
     "surface."},
    {"worst", wholeNumber().within(0, 100000).byDefault("10"), "Number of worst points to list."},
    {"script", outputFile("FILE"),
     "Writes a script, *.hps, that shows each of the worst points in the explorer. Run it from the same folder."},
    {"any-mesh", flag(), "Accepts a mesh from which the field was not made, for instance a simplified one."}};

std::vector<Parameter> limitParameters() {
  std::vector<Parameter> parameters;
  for (const Threshold& threshold : kThresholds)
    parameters.push_back(
        {threshold.option, threshold.counts ? wholeNumber().within(0, 1e9) : number().atLeast(0), threshold.help});
  return parameters;
}

}  // namespace

void addVerifyCommand(Registry& registry) {
  registry.add({
      .name = "verify",
      .summary = "Measure the errors of a field, and fail where they exceed limits.",
      .help = paragraphs(R"(
Compares the field with the exact distance of MESH at random points, half of them uniform in the domain and half near
the surface. It prints RMS, mean, percentiles and maximum of the error; wrong signs; the angle between the gradients,
the length of the field's gradient and slopes; the jumps between cells; steps of the queried values across faces, at as
many random points of faces; and the worst points, one of each cell. Lengths are in the field's units. The same seed
gives the same figures for any number of threads.

Use it to judge a field, or with limits (--max-…) in automated tests: where a limit is exceeded, all figures are
written, the last line names the limit, and the exit status is 1. A mesh from which the field was not made is refused. For a field of 'hpsdf combine', MESH is its
expression, if that is a Boolean one of closed meshes.

Signs between the surface and the field's zero level are always wrong. Only wrong signs farther from the surface than
the sign bound are defects; --max-mismatches counts these.)"),
      .examples = {"hpsdf verify bunny.hpsdf bunny.obj",
                   "hpsdf verify bunny.hpsdf bunny.obj --max-rms 5e-4 --max-error 0.02 --max-mismatches 0",
                   "hpsdf verify torus.hpsdf --points 1e7 --band 0.05 --json",
                   "hpsdf verify bunny.hpsdf bunny.obj --worst 5 --script worst.hps"},
      .parameters = joined({{fieldParameter(), surfaceParameter()},
                            under("Sampled points", sampledParameters()),
                            kReported,
                            under("Limits", limitParameters()),
                            {threadsParameter("The figures are")}}),
      .action = runVerify,
  });
}

}  // namespace hpsdf::app
