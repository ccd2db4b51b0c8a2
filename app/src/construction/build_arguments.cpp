#include "construction/build_arguments.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "hpsdf/build.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::uint64_t kDefaultMemory = 100'000'000;  // bytes; default memory limit if no size limit is given

ParameterKind kindOf(const BuildSetting& setting) {
  using enum BuildSetting::Type;
  ParameterKind kind = setting.type == wholeNumbers ? app::wholeNumbers("N|NX,NY,NZ", {1, 3})
                       : setting.type == choice     ? app::choice({setting.words.begin(), setting.words.end()})
                       : setting.type == flag       ? app::flag()
                       : setting.type == number     ? app::number()
                                                    : app::wholeNumber();
  kind.minimumExcluded = setting.minimumExcluded;
  if (std::isfinite(setting.minimum)) kind.minimum = setting.minimum;
  if (std::isfinite(setting.maximum)) kind.maximum = setting.maximum;
  kind.mayBeShare = setting.mayBeShare;
  return kind.byDefault(defaultText(setting)).in(std::string(setting.unit));
}

Parameter parameterFrom(const BuildSetting& setting) {
  Parameter parameter(std::string(setting.name), kindOf(setting), std::string(setting.help));
  parameter.group = setting.group;
  parameter.isAdvanced = setting.isAdvanced;
  return parameter;
}

/// Returns the value that the arguments give to a setting. Percentages refer to the mesh's longest side.
std::vector<double> valueOf(const Arguments& arguments, const BuildSetting& setting, double longestSide) {
  const std::string name(setting.name);
  if (arguments.isShare(name)) return {arguments.number(name) * longestSide};
  if (setting.type == BuildSetting::Type::flag) return {arguments.flag(name) ? 1.0 : 0.0};
  if (setting.type != BuildSetting::Type::choice) return arguments.numbers(name);
  return {double(std::ranges::find(setting.words, arguments.text(name)) - setting.words.begin())};
}

const std::vector<Parameter> kDomain = {
    {"domain", numbers("cube|box|x0,y0,z0,x1,y1,z1", {6}).orWords({"cube", "box"}).byDefault("cube"),
     "Where the field is defined by polynomials: the cube or the box around the mesh, enlarged by the margin, or two "
     "corners in world units (after normalizing)."},
    {"margin", number().atLeast(0).byDefault("0.1"),
     "By which part the cube or box is larger than the mesh, e.g. 0.1 for half-sizes times 1.1."},
    {"normalize", flag(),
     "Scale and centre the mesh so that its longest side spans [-1, 1], as the paper does. Without it the field stays "
     "in the mesh's own units."}};

const std::vector<Parameter> kInside = {
    {"sign", choice({"auto", "pseudonormal", "winding", "unsigned-shell"}).byDefault("auto"),
     "How inside is told from outside. pseudonormal: by the normals of the closest faces, for closed meshes that do "
     "not intersect themselves. winding: by how often the faces surround a point, for any mesh; holes are closed. "
     "unsigned-shell: all is outside but a wall around the faces, --thickness wide, for sheets. auto: pseudonormal "
     "where that is certain to be right, else winding, and says why."},
    {"hull", flag().alsoCalled("outer-hull"),
     "Leave out faces, or parts of them, that have the inside on both sides, such as walls within bodies that "
     "overlap: they are no surface then. The sign is by winding number."},
    {"thickness", number().above(0).in("world units").advanced(),
     "Thickness of the wall that --sign unsigned-shell makes."}};

const std::vector<Parameter> kPlacement = {
    {"spacing", numbers("H|HX,HY,HZ", {1, 3}).above(0).advanced(),
     "Distance of the points of a grid of NumPy (.npy), whose file does not tell it; 1 by default."},
    {"origin", numbers("X,Y,Z", {3}).advanced(),
     "Position of the first point of a grid of NumPy (.npy); 0,0,0 by default."}};

const Parameter kPaper = {
    "paper", flag().under("The paper's settings"),
    "All of the paper's settings but τ and grid at once: normalize, margin 0.1, cube, nearness 4, max-degree 30, "
    "max-depth 10, quadrature 4 by products with samples of its own for each trial, double. Options that are given "
    "too win."};

void insertBefore(std::vector<Parameter>& parameters, const char* name, const std::vector<Parameter>& more) {
  parameters.insert(std::ranges::find(parameters, name, &Parameter::name), more.begin(), more.end());
}

bool isAnyGiven(const Arguments& arguments, std::initializer_list<BuildSetting::Ending> endings) {
  return std::ranges::any_of(endParameters(endings), [&](const std::string& name) { return arguments.given(name); });
}

/// Throws `Error` for a setting that is given and has no effect on a construction within a tolerance.
void requireEffect(const Arguments& arguments) {
  if (const std::string name = givenWithoutEffectWithinTolerance(arguments); !name.empty())
    throw Error(
        fmt::format("{0} has no effect with tolerance, which decides how the field is built: leave out {0}, or give a "
                    "target error in place of a tolerance",
                    name));
  if (arguments.flag("paper")) throw Error("paper and tolerance exclude each other: give one of them");
}

/// Returns true if nothing given limits the size of the field, so that a default limits the memory.
bool hasDefaultMemoryLimit(const Arguments& arguments) {
  using enum BuildSetting::Ending;
  const bool isSizeGiven = isAnyGiven(arguments, {byDistance, tolerance, otherQuantity, target, steps});
  return !isSizeGiven && !arguments.given("grid") && !arguments.given("memory-limit") && arguments.has("target-error");
}

InsideTest insideTestOf(const std::string& name) {
  if (name == "pseudonormal") return InsideTest::pseudonormal;
  if (name == "winding") return InsideTest::winding;
  return name == "unsigned-shell" ? InsideTest::shell : InsideTest::automatic;
}

}  // namespace

std::string givenWithoutEffectWithinTolerance(const Arguments& arguments) {
  for (const BuildSetting& setting : buildSettings())
    if (setting.isOffered && arguments.given(setting.name) && !setting.hasEffectWithTolerance &&
        setting.ending != BuildSetting::Ending::target)
      return std::string(setting.name);
  return "";
}

ParameterKind settingKind(const char* name) { return kindOf(buildSetting(name)); }

Parameter settingParameter(const char* name) { return parameterFrom(buildSetting(name)); }

Strategy strategyOf(const Arguments& arguments) {
  const BuildSetting& setting = buildSetting("strategy");
  BuildOptions options;
  setting.set(options, valueOf(arguments, setting, 1));
  return options.strategy;
}

Parameter threadsParameter(const std::string& result) {
  return {"threads", settingKind("threads").under(kGeneral),
          fmt::format("Threads to use; 0 for all. {} the same whatever their number.", result)};
}

Parameter pointsParameter(std::string help, std::string count, double minimum) {
  constexpr double kMost = 1e8;  // 100 million points need 10 GB of memory
  return {"points", wholeNumber().within(minimum, kMost).byDefault(std::move(count)), std::move(help)};
}

Parameter seedParameter(std::string help) {
  return {"seed", wholeNumber().within(0, 1e9).byDefault("1").under(kGeneral).advanced(), std::move(help)};
}

std::vector<Parameter> buildParameters() {
  std::vector<Parameter> parameters;
  for (const BuildSetting& setting : buildSettings())
    if (setting.isOffered) parameters.push_back(parameterFrom(setting));
  insertBefore(parameters, "strategy", under(setting_group::kResult, kDomain));
  insertBefore(parameters, "band", under("The surface", kInside));
  insertBefore(parameters, "band", under("The surface", kPlacement));
  parameters.push_back(kPaper);
  return parameters;
}

std::vector<Parameter> checkpointParameters() {
  return {
      {"checkpoint", flag().under(kFiles),
       "Keep the state of the construction from time to time, as OUTPUT.checkpoint. Where that is there already, "
       "because the program was killed, go on from it: the field is the same, to the byte, as in one go. A state of "
       "another mesh, of other options but threads and memory-limit, or a damaged one is refused; once the field is "
       "written it is removed."},
      {"checkpoint-seconds", number().within(0, 1e9).in("seconds").under(kFiles).advanced().byDefault("5"),
       "Least time between two checkpoints. It is longer where writing takes long: at most 2 % of the time go into "
       "it."},
  };
}

Parameter outOfCoreParameter() {
  return {
      "out-of-core", file("DIR").under(kFiles),
      "Divides a mesh that does not fit into memory into parts, in this folder, some 150 bytes a face, and reads "
      "those that distances ask for: at most half of memory-limit at once. The parts stay there for the next field "
      "of the mesh. A binary PLY file of triangles, without properties of faces, is never loaded as a whole. There "
      "are no exact leaves, and the estimator checks no points of the surface; with --strategy hp --estimator "
      "embedded the octree is that of the mesh in memory, to the bit. The mesh must be clean. It must also be closed "
      "and in one piece, unless --sign pseudonormal trusts its normals."};
}

std::vector<std::string> endParameters(std::initializer_list<BuildSetting::Ending> endings) {
  std::vector<std::string> names;
  for (const BuildSetting& setting : buildSettings())
    if (std::ranges::find(endings, setting.ending) != endings.end()) names.emplace_back(setting.name);
  return names;
}

std::vector<std::string> endParametersAndTheirs(std::initializer_list<BuildSetting::Ending> endings) {
  std::vector<std::string> names = endParameters(endings);
  for (const BuildSetting& setting : buildSettings())
    if (std::ranges::find(names, setting.owner) != names.end()) names.emplace_back(setting.name);
  return names;
}

BuildOptions buildOptions(const Arguments& arguments, double longestSide) {
  using Ending = BuildSetting::Ending;
  BuildOptions options = arguments.flag("paper") ? paperOptions() : BuildOptions{};
  const bool endsOtherwise = isAnyGiven(arguments, {Ending::byDistance, Ending::otherQuantity, Ending::tolerance});
  if (endsOtherwise) options.targetError = 0;
  if (arguments.given("tolerance")) requireEffect(arguments);
  for (const BuildSetting& setting : buildSettings()) {
    if (!setting.isOffered || !arguments.given(setting.name)) continue;
    if (setting.hasOwner != nullptr && setting.type == BuildSetting::Type::flag && !arguments.flag(setting.name))
      continue;  // the flag is off, as it is without its owner
    if (!setting.exclusive.empty() && arguments.given(setting.exclusive))
      throw Error(fmt::format("{} and {} exclude each other: give one of them", setting.exclusive, setting.name));
    if (setting.hasOwner != nullptr)
      requireOwner(arguments, setting.name.data(), setting.owner.data(), setting.hasOwner(options));
    setting.set(options, valueOf(arguments, setting, longestSide));
  }
  if (hasDefaultMemoryLimit(arguments)) options.memoryLimit = kDefaultMemory;
  return options;
}

std::vector<Parameter> insideParameters() { return kInside; }

DistanceOptions insideOptions(const Arguments& arguments) {
  DistanceOptions options{.insideTest = insideTestOf(arguments.text("sign")),
                          .threads = int(arguments.whole("threads"))};
  if (arguments.flag("hull")) {
    if (options.insideTest != InsideTest::automatic && options.insideTest != InsideTest::winding)
      throw Error(fmt::format("hull: goes by winding number: leave out sign {}", arguments.text("sign")));
    options.insideTest = InsideTest::outerHull;
  }
  if (options.insideTest == InsideTest::shell && !arguments.given("thickness"))
    throw Error("sign unsigned-shell: give the wall a thickness, such as a hundredth of the mesh's size");
  requireOwner(arguments, "thickness", "sign unsigned-shell", options.insideTest == InsideTest::shell);
  if (options.insideTest == InsideTest::shell) options.thickness = arguments.number("thickness");
  return options;
}

DistanceOptions distanceOptions(const Arguments& arguments) {
  const DistanceOptions options = insideOptions(arguments);
  if (options.insideTest == InsideTest::pseudonormal && arguments.flag("certified"))
    throw Error(
        "certified: nothing is proven where sign pseudonormal is forced upon a mesh: leave out sign; auto takes "
        "pseudonormals wherever they are certain to be right");
  return options;
}

GridPlacement gridPlacement(const Arguments& arguments) {
  GridPlacement placement;
  if (arguments.given("spacing")) {
    const auto h = arguments.numbers("spacing");
    placement.spacing = h.size() == 1 ? Vector3::Constant(h[0]) : Vector3(h[0], h[1], h[2]);
  }
  if (arguments.given("origin")) {
    const auto x = arguments.numbers("origin");
    placement.origin = Vector3(x[0], x[1], x[2]);
  }
  return placement;
}

bool wantsNormalized(const Arguments& arguments) {
  return arguments.flag(arguments.given("normalize") ? "normalize" : "paper");
}

Box domainFrom(const Arguments& arguments, const Box& surface) {
  const std::string shape = arguments.text("domain");
  const double margin = arguments.number("margin");
  if (shape == "box") return domainAround(surface, DomainShape::box, margin);
  if (shape != "cube") {
    const auto c = arguments.numbers("domain");
    const Box domain(Vector3(c[0], c[1], c[2]), Vector3(c[3], c[4], c[5]));
    if (!(domain.sizes().minCoeff() > 0))
      throw Error(fmt::format("domain {}: expected lower corner x0,y0,z0 below upper corner x1,y1,z1", shape));
    return domain;
  }
  // For a normalized mesh, use exactly the cube of the paper: a cube computed from the mesh's bounding box would
  // contain rounding errors.
  if (wantsNormalized(arguments)) return Box(Vector3::Constant(-(1 + margin)), Vector3::Constant(1 + margin));
  return domainAround(surface, DomainShape::cube, margin);
}

void requireConsistent(const Arguments& arguments) {
  const Box any(Vector3::Constant(-1), Vector3::Constant(1));
  distanceOptions(arguments);
  withinMemory(arguments,
               [&] { checkBuild(domainFrom(arguments, any), buildOptions(arguments, any.sizes().maxCoeff())); });
}

Error namingMemoryLimit(const MemoryLimitError& error, const Arguments& arguments) {
  std::string text = error.shortage();
  text += error.enough() > 0 ? fmt::format(", or allow more memory: --memory-limit {} is likely to suffice",
                                           shortNumber(double(error.enough())))
                             : "; this machine does not allow more memory";
  if (hasDefaultMemoryLimit(arguments))
    text += fmt::format(" (where no target is given either, {} GB are allowed besides the mesh's distance)",
                        double(kDefaultMemory) / 1e9);
  return Error(error.kind(), error.subject(), text);
}

Error constructionOutOfMemory() {
  return Error(ErrorKind::limit, "",
               "not enough memory; a larger tolerance or target error, or a coarser grid, needs less");
}

void requireOwner(const Arguments& arguments, const char* name, const char* owner, bool ownerIsGiven) {
  if (arguments.given(name) && !ownerIsGiven)
    throw Error(fmt::format("{} belongs to {}: give that too, or leave it out", name, owner));
}

bool decides(const Parameter& parameter) {
  const auto found = std::ranges::find(buildSettings(), std::string_view(parameter.name), &BuildSetting::name);
  return found == buildSettings().end() || found->decides;
}

std::string decidingArguments(const Arguments& arguments) {
  std::string text;
  for (const Parameter& parameter : buildParameters()) {
    if (!decides(parameter) || !arguments.has(parameter.name)) continue;
    const std::vector<double> numbers = arguments.numbers(parameter.name);
    text += fmt::format("{}={}\n", parameter.name,
                        numbers.empty() ? arguments.text(parameter.name) : fmt::format("{}", fmt::join(numbers, ",")));
  }
  return text;
}

std::string buildCommandLine(const std::string& surface, const std::string& file, const Arguments& arguments) {
  std::string line = fmt::format("hpsdf build {} -o {}", shellWord(surface), file);
  for (const Parameter& parameter : buildParameters()) {
    if (!arguments.given(parameter.name)) continue;
    const std::string text = arguments.text(parameter.name);
    line += parameter.type == ParameterType::flag && arguments.flag(parameter.name)
                ? fmt::format(" --{}", parameter.name)
                : fmt::format(" --{}={}", parameter.name, text);
  }
  return line;
}

}  // namespace hpsdf::app
