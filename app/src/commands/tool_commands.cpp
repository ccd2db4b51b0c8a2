#include "commands/tool_commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <thread>

#include "commands/mesh_command.h"
#include "console/machine.h"
#include "console/version.h"
#include "construction/building.h"
#include "files/text_file.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"
#include "language/help.h"
#include "language/script.h"
#include "pictures/picture_arguments.h"
#include "session/backend.h"
#include "session/session.h"
#include "text/json.h"

namespace hpsdf::app {
namespace {

constexpr int kMostNestedScripts = 16;

/// Counts the scripts now running, and the setting of --json for what they call.
class ScriptScope {
 public:
  ScriptScope(Session& session, bool json) : session_(session), jsonBefore_(session.setJson(json)) {
    ++session_.scriptDepth;
  }
  ~ScriptScope() {
    --session_.scriptDepth;
    session_.setJson(jsonBefore_);
  }
  ScriptScope(const ScriptScope&) = delete;
  ScriptScope& operator=(const ScriptScope&) = delete;

 private:
  Session& session_;
  bool jsonBefore_;
};

void runRun(Session& session, const Arguments& arguments) {
  std::vector<std::string> words = arguments.texts("script");
  const std::vector<std::string> lines = arguments.texts("execute");
  if (words.empty() && lines.empty()) throw Error("run: give a script's file, or lines with -e");
  const std::string name = lines.empty() ? words.front() : "-e";
  if (lines.empty()) words.erase(words.begin());
  const std::string text = lines.empty() ? readTextFile(name) : fmt::format("{}", fmt::join(lines, "\n"));
  if (session.scriptDepth >= kMostNestedScripts)
    throw Error(fmt::format("{}: more than {} scripts run each other; does one run itself?", name, kMostNestedScripts));
  const auto calls = parseScript(session.registry(), name, text, parseVariables(words));
  const ScriptScope scope(session, session.wantsJson(arguments));
  runScript(session, calls);
}

void runSet(Session& session, const Arguments& arguments) {
  if (session.wantsJson(arguments))
    printJson(session.console().out, Json(parseVariables(arguments.texts("assignments"))));
}

void runInclude(Session& session, const Arguments& arguments) {
  if (session.wantsJson(arguments)) printJson(session.console().out, {{"included", arguments.text("script")}});
}

Json shapesJson() {
  Json list = Json::array();
  for (const shapes::Shape& shape : shapes::catalogue()) {
    Json parameters = Json::array();
    for (const shapes::Parameter& parameter : shape.parameters)
      parameters.push_back({{"name", parameter.name},
                            {"default", parameter.defaultValue},
                            {"minimum", parameter.minimum},
                            {"maximum", parameter.maximum},
                            {"whole", parameter.whole},
                            {"help", parameter.help}});
    list.push_back(
        {{"name", shape.name}, {"help", shape.help}, {"analytic", shape.analytic}, {"parameters", parameters}});
  }
  return list;
}

void runShapes(Session& session, const Arguments& arguments) {
  std::ostream& out = session.console().out;
  if (session.wantsJson(arguments)) return printJson(out, shapesJson());
  for (const shapes::Shape& shape : shapes::catalogue()) {
    out << fmt::format("builtin:{}{}\n  {}\n", shape.name,
                       shape.analytic ? fmt::format(", analytic:{}", shape.name) : "", shape.help);
    for (const shapes::Parameter& parameter : shape.parameters)
      out << fmt::format("    {:<12} {} ({}{} to {}; default {})\n", parameter.name, parameter.help,
                         parameter.whole ? "whole, " : "", parameter.minimum, parameter.maximum,
                         parameter.defaultValue);
  }
}

void runDoctor(Session& session, const Arguments& arguments) {
  std::string renderer;
  std::string problem;
  try {
    renderer = render::glDescription(glChoice(arguments));
  } catch (const Error& error) {
    problem = error.what();
  }
  const auto simd = simdOfCpu();
  const unsigned threads = std::thread::hardware_concurrency();
  const bool readsApart = !session.console().meshReader.empty();
  if (session.wantsJson(arguments)) {
    Json instructions = Json::object();
    for (const auto& [name, there] : simd) instructions[name] = there;
    return printJson(session.console().out, {{"version", versionText()},
                                             {"compiler", compilerText()},
                                             {"renderer", problem.empty() ? Json(renderer) : Json()},
                                             {"renderer_problem", problem.empty() ? Json() : Json(problem)},
                                             {"processor", processorName()},
                                             {"simd", instructions},
                                             {"simd_used", instructionSet()},
                                             {"threads", threads},
                                             {"mesh_reader", readsApart ? "own process" : "this process"},
                                             {"assimp", assimpVersion()}});
  }
  std::vector<std::string> present;
  for (const auto& [name, there] : simd)
    if (there) present.push_back(name);
  const auto row = [&](std::string_view name, const std::string& text) {
    session.console().out << fmt::format("{:<10} {}\n", name, text);
  };
  row("version", versionText());
  row("compiler", compilerText());
  row("renderer", problem.empty() ? renderer : "none: " + problem);
  row("processor", processorName());
  row("SIMD",
      fmt::format("{}; exact distances use {}",
                  present.empty() ? "the baseline" : fmt::format("{}", fmt::join(present, ", ")), instructionSet()));
  row("threads", std::to_string(threads));
  row("meshes", readsApart ? "each file is read by a process of its own, with limits of time and memory"
                           : "files are read by this process, without limits: it cannot be started again");
  row("assimp", assimpVersion());
}

void runHelp(Session& session, const Arguments& arguments) {
  std::ostream& out = session.console().out;
  const Registry& registry = session.registry();
  if (session.wantsJson(arguments)) return printJson(out, commandsJson(registry));
  out << (arguments.has("command") ? commandHelp(registry.command(arguments.text("command"))) : overviewHelp(registry));
}

void runDocs(Session& session, const Arguments& arguments) {
  std::ostream& out = session.console().out;
  const std::string page = commandsMarkdown(session.registry());
  const bool json = session.wantsJson(arguments);
  if (!arguments.has("output")) {
    if (json) return printJson(out, {{"output", Json()}, {"page", page}});
    out << page;
    return;
  }
  const std::string file = arguments.text("output");
  OutputFile written(file);
  written.write(page);
  written.commit();
  const std::size_t count = session.registry().commands().size();
  if (json) return printJson(out, {{"output", file}, {"commands", count}});
  out << fmt::format("{}: {} commands\n", file, count);
}

Command runCommand() {
  return {
      .name = "run",
      .summary = "Run a script, or script lines given with -e.",
      .help =
          "A script holds a command a line: verb value key=value …, with \"quotes\", # comments, and ; between "
          "commands of one line. $name or ${name} is replaced by the value given as name=value after the "
          "script. The whole script is checked before its first command runs; a mistake stops with "
          "file:line:column. Relative paths start at the current folder. docs/scripts.md tells more.",
      .examples = {"hpsdf run pictures.hps mesh=bunny.obj", "hpsdf run -e 'build builtin:torus; slice output=x.png'"},
      .parameters = {{.name = "script",
                      .type = ParameterType::text,
                      .help = "The script's file, then name=value for its variables. With -e only variables.",
                      .valueName = "SCRIPT name=value",
                      .positional = true,
                      .repeatable = true},
                     {.name = "execute",
                      .type = ParameterType::text,
                      .help = "A line of script instead of a file.",
                      .valueName = "LINE",
                      .alias = 'e',
                      .repeatable = true}},
      .action = runRun,
      .takesVariables = true};
}

Command doctorCommand() {
  auto parameters = backendParameters();
  std::erase_if(parameters, [](const Parameter& parameter) { return parameter.name == "cpu"; });
  return {.name = "doctor",
          .summary = "Tell what this program runs on: renderer, SIMD, threads.",
          .help =
              "The OpenGL device that pictures would be drawn with, or why there is none; instruction sets of the "
              "processor; threads; whether mesh files are read by a process of their own; versions.",
          .examples = {"hpsdf doctor", "hpsdf doctor --gl software"},
          .parameters = std::move(parameters),
          .action = runDoctor};
}

}  // namespace

void addToolCommands(Registry& registry) {
  registry.add(runCommand());
  registry.add(meshCommand(registry));
  registry.add({.name = "shapes",
                .summary = "List the built-in shapes and their parameters.",
                .help = "builtin:NAME is a shape's triangle mesh, analytic:NAME its distance in closed form.",
                .examples = {"hpsdf shapes", "hpsdf build analytic:sphere,radius=0.5 -o sphere.hpsdf"},
                .action = runShapes});
  registry.add(doctorCommand());
  registry.add({.name = "set",
                .summary = "Give variables a value for the rest of the script.",
                .help = "$name or ${name} stands for the value in the lines below. A value given here wins over one "
                        "given on the command line.",
                .examples = {"set size=640x360 mesh=bunny.obj"},
                .parameters = {{.name = "assignments",
                                .type = ParameterType::text,
                                .help = "What to set.",
                                .valueName = "name=value",
                                .positional = true,
                                .repeatable = true,
                                .need = Need::always}},
                .action = runSet,
                .scriptOnly = true,
                .takesVariables = true,
                .definesVariables = true});
  registry.add({.name = "include",
                .summary = "The lines of another script, as if they stood here.",
                .help = "They see the variables of the lines above, and what they set holds for the lines below. The "
                        "file is read and checked with the script, before anything runs. A relative name starts at the "
                        "folder of the script that includes it.",
                .examples = {"include settings.hps"},
                .parameters = {{.name = "script",
                                .type = ParameterType::path,
                                .help = "The script's file.",
                                .valueName = "SCRIPT",
                                .positional = true,
                                .need = Need::always}},
                .action = runInclude,
                .scriptOnly = true,
                .includesScript = true});
  registry.add({.name = "help",
                .summary = "Explain the program or a command.",
                .help = "Without a command, an overview.",
                .examples = {"hpsdf help", "hpsdf help build"},
                .parameters = {{.name = "command",
                                .type = ParameterType::text,
                                .help = "The command to explain.",
                                .valueName = "COMMAND",
                                .positional = true}},
                .action = runHelp});
  registry.add({.name = "docs",
                .summary = "Write the reference of all commands, a Markdown page.",
                .help = "docs/commands.md is that page: commands, parameters, ranges and defaults as this program has "
                        "them.",
                .examples = {"hpsdf docs -o docs/commands.md"},
                .parameters = {{.name = "output",
                                .type = ParameterType::outputPath,
                                .help = "File to write; standard output when left out.",
                                .alias = 'o'}},
                .action = runDocs});
}

}  // namespace hpsdf::app
