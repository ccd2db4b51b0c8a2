#include "study/study_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "session/session.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Returns all kinds of studies. To add a kind to the command `study`, add it to this list.
const std::vector<Study>& studies() {
  static const std::vector<Study> list = {convergenceStudy(), tableStudy(), continuityStudy(), tradeoffStudy()};
  return list;
}

/// Returns the study's parameter `name`, or nullptr if the study has no such parameter.
const Parameter* parameterOf(const Study& study, const std::string& name) {
  const auto found = std::ranges::find(study.parameters, name, &Parameter::name);
  return found == study.parameters.end() ? nullptr : &*found;
}

std::vector<const Study*> takersOf(const std::string& parameter) {
  std::vector<const Study*> takers;
  for (const Study& study : studies())
    if (parameterOf(study, parameter) != nullptr) takers.push_back(&study);
  return takers;
}

std::string namesOf(const std::vector<const Study*>& studies) {
  std::vector<std::string> names;
  for (const Study* study : studies) names.push_back(fmt::format("'study {}'", study->name));
  return fmt::format("{}", fmt::join(names, " and "));
}

const Study& studyOf(const Arguments& arguments) {
  return *std::ranges::find(studies(), arguments.text("kind"), &Study::name);
}

/// Returns the parameters of all kinds of studies, each parameter once. A parameter whose default differs
/// between the kinds has no default here; `buildArguments` sets the default of the study that is run.
std::vector<Parameter> kindParameters() {
  std::vector<Parameter> all;
  for (const Study& study : studies())
    for (Parameter parameter : study.parameters) {
      if (std::ranges::find(all, parameter.name, &Parameter::name) != all.end()) continue;
      const std::vector<const Study*> takers = takersOf(parameter.name);
      if (takers.size() < studies().size()) parameter.group = "Options of " + namesOf(takers);
      const auto sameDefault = [&](const Study* other) {
        return parameterOf(*other, parameter.name)->defaultText == parameter.defaultText;
      };
      if (!std::ranges::all_of(takers, sameDefault)) {
        for (const Study* taker : takers)
          parameter.help += fmt::format(" {} takes {}.", taker->name, parameterOf(*taker, parameter.name)->defaultText);
        parameter.defaultText.clear();
      }
      all.push_back(std::move(parameter));
    }
  return all;
}

void checkStudy(const Arguments& arguments) {
  const Study& study = studyOf(arguments);
  for (const Parameter& parameter : kindParameters())
    if (arguments.given(parameter.name) && parameterOf(study, parameter.name) == nullptr)
      throw Error(fmt::format("{}: is for {}, not for 'study {}'", parameter.name, namesOf(takersOf(parameter.name)),
                              study.name));
}

}  // namespace

std::vector<Parameter> buildParametersWithout(const std::vector<std::string>& names) {
  std::vector<Parameter> parameters = without(names, buildParameters());
  for (Parameter& parameter : parameters) parameter.isRepeatable = parameter.type != ParameterType::flag;
  return parameters;
}

std::vector<Parameter> samplingParameters() {
  return {pointsParameter("Random points in the domain at which errors are measured.", "200000", 1), seedParameter()};
}

ExactSamples exactSamples(const Console& console, const Arguments& arguments, const DistanceFunction& exact,
                          const Box& domain, int threads, double near) {
  const SampleOptions options{.count = static_cast<std::size_t>(arguments.number("points")),
                              .seed = static_cast<std::uint64_t>(arguments.number("seed")),
                              .threads = threads};
  return withProgress(console,
                      [&](const Progress& progress) { return sampleUniform(exact, domain, near, options, progress); });
}

Arguments buildArguments(const Session& session, const Arguments& arguments, std::size_t mesh,
                         const std::vector<std::string>& more) {
  const std::vector<std::string> meshes = arguments.texts("mesh");
  const Command& build = session.registry().command("build");
  std::vector<Word> words = {{.text = meshes[mesh]}};
  const Study& study = studyOf(arguments);
  for (const Parameter& parameter : build.parameters) {
    const Parameter* own = parameterOf(study, parameter.name);
    const bool hasOwnDefault = own != nullptr && own->defaultText != parameter.defaultText;
    if (own == nullptr || !(arguments.given(parameter.name) || hasOwnDefault)) continue;
    const std::vector<std::string> values =
        arguments.given(parameter.name) ? arguments.texts(parameter.name) : std::vector{own->defaultText};
    if (values.size() != 1 && values.size() != meshes.size())
      throw Error(fmt::format("{}: given {} times for {} meshes; give it once for all, or once for each",
                              parameter.name, values.size(), meshes.size()));
    words.push_back({.text = fmt::format("--{}={}", parameter.name, values[values.size() == 1 ? 0 : mesh])});
  }
  for (const std::string& option : more) words.push_back({.text = option});
  return parseArguments(build, words, Origin::script);
}

std::vector<std::string> checkedNames(const Session& session, const Arguments& arguments) {
  std::vector<std::string> names;
  for (const std::string& mesh : arguments.texts("mesh")) {
    buildArguments(session, arguments, names.size());
    const std::string plain = plainName(mesh);
    std::string name = plain;
    for (int number = 2; std::ranges::find(names, name) != names.end(); ++number)
      name = fmt::format("{}-{}", plain, number);
    names.push_back(name);
  }
  return names;
}

std::string rowText(const Json& row, const char* separator) {
  const auto cellText = [](const Json& value) {
    if (value.is_null()) return std::string();
    if (value.is_boolean()) return std::to_string(int(value.get<bool>()));
    if (value.is_number_integer()) return value.dump();
    if (value.is_number()) return fmt::format("{}", value.get<double>());
    std::string quoted = "\"";
    for (const char c : value.get<std::string>()) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
  };
  std::vector<std::string> cells;
  for (const Json& value : row) cells.push_back(cellText(value));
  return fmt::format("{}", fmt::join(cells, separator));
}

void addStudyCommand(Registry& registry) {
  std::string help =
      "Builds fields of each MESH and writes tables and plots into a folder, as text for people and JSON for programs. "
      "KIND selects the study:";
  std::vector<std::string> kinds;
  for (const Study& study : studies()) {
    kinds.push_back(study.name);
    help += fmt::format("\n\n{}: {}", study.name, study.help);
  }
  registry.add({
      .name = "study",
      .summary = "Study size, time and accuracy of fields, as the paper does.",
      .help = help,
      .examples = {"hpsdf study convergence builtin:torus -o convergence --at 1.5e-4",
                   "hpsdf study table bunny.obj dragon.obj -o table --target-error 1e-6 --target-error 1e-7 --grid 6 "
                   "--grid 10",
                   "hpsdf study continuity bunny.obj -o continuity --target-error 1e-5",
                   "hpsdf study tradeoff bunny.obj -o tradeoff --budget 4e6"},
      .parameters = joined(
          {{{"kind", choice(kinds).positional().required(), "Kind of the study."},
            {"mesh", text("MESH").positional().repeatable().required(), "Mesh files, builtin:SHAPE or analytic:SHAPE."},
            {"output", outputFile("FOLDER").as('o').required(),
             "Folder of the results. It is created where it does not exist."}},
           kindParameters()}),
      .action = [](Session& session, const Arguments& arguments) { studyOf(arguments).run(session, arguments); },
      .check = checkStudy,
  });
}

}  // namespace hpsdf::app
