#include "commands/tool_commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <thread>

#include "commands/mesh_command.h"
#include "console/machine.h"
#include "console/version.h"
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

/// Counts a running script, and sets --json for the commands that it runs.
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
    throw Error(fmt::format("{}: more than {} scripts run each other; check whether one runs itself", name,
                            kMostNestedScripts));
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

/// Facts about the machine and the build.
struct Diagnosis {
  std::string renderer = {};
  std::string rendererProblem = {};  ///< why there is no renderer; "" where there is one
  std::vector<std::pair<std::string, bool>> simd = simdOfCpu();
  unsigned threads = std::thread::hardware_concurrency();
  bool hasMeshReader = false;  ///< a process of its own reads mesh files
};

Diagnosis diagnosed(const Session& session, const Arguments& arguments) {
  Diagnosis found{.hasMeshReader = !session.console().meshReader.empty()};
  try {
    found.renderer = render::glDescription(glChoice(arguments));
  } catch (const Error& error) {
    found.rendererProblem = error.what();
  }
  return found;
}

Json doctorJson(const Diagnosis& found) {
  Json instructions = Json::object();
  for (const auto& [name, supported] : found.simd) instructions[name] = supported;
  const bool draws = found.rendererProblem.empty();
  return {{"version", versionText()},
          {"compiler", compilerText()},
          {"renderer", draws ? Json(found.renderer) : Json()},
          {"renderer_problem", draws ? Json() : Json(found.rendererProblem)},
          {"processor", processorName()},
          {"simd", instructions},
          {"simd_used", instructionSet()},
          {"threads", found.threads},
          {"mesh_reader", found.hasMeshReader ? "own process" : "this process"},
          {"assimp", assimpVersion()}};
}

std::string doctorText(const Diagnosis& found) {
  std::vector<std::string> supported;
  for (const auto& [name, isSupported] : found.simd)
    if (isSupported) supported.push_back(name);
  std::string text;
  const auto row = [&](std::string_view name, const std::string& value) {
    text += fmt::format("{:<10} {}\n", name, value);
  };
  row("version", versionText());
  row("compiler", compilerText());
  row("renderer", found.rendererProblem.empty() ? found.renderer : "none: " + found.rendererProblem);
  row("processor", processorName());
  row("SIMD", fmt::format("{}; exact distances use {}",
                          supported.empty() ? "the baseline" : fmt::format("{}", fmt::join(supported, ", ")),
                          instructionSet()));
  row("threads", std::to_string(found.threads));
  row("meshes", found.hasMeshReader ? "each file is read by a process of its own, with limits of time and memory"
                                    : "files are read by this process, without limits: it cannot be started again");
  row("assimp", assimpVersion());
  return text;
}

void runDoctor(Session& session, const Arguments& arguments) {
  const Diagnosis found = diagnosed(session, arguments);
  if (session.wantsJson(arguments)) return printJson(session.console().out, doctorJson(found));
  session.console().out << doctorText(found);
}

void runHelp(Session& session, const Arguments& arguments) {
  std::ostream& out = session.console().out;
  const Registry& registry = session.registry();
  if (session.wantsJson(arguments)) return printJson(out, commandsJson(registry));
  const HelpDetail detail = arguments.flag("all") ? HelpDetail::all : HelpDetail::common;
  out << (arguments.has("command") ? commandHelp(registry.command(arguments.text("command")), detail)
                                   : overviewHelp(registry));
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

void addMachineCommands(Registry& registry) {
  registry.add({
      .name = "shapes",
      .summary = "List the built-in shapes and their parameters.",
      .help =
          "Commands accept builtin:NAME, the triangle mesh of a shape, and analytic:NAME, its distance in closed form.",
      .examples = {"hpsdf shapes", "hpsdf build analytic:sphere,radius=0.5 -o sphere.hpsdf"},
      .action = runShapes,
  });
  registry.add({
      .name = "doctor",
      .summary = "Show the machine and the libraries that the program uses.",
      .help = "Prints the OpenGL device that would draw pictures, or why there is none; the instruction "
              "sets of the processor; the number of threads; whether a process of its own reads mesh files; and "
              "versions. Use it when pictures fail, and attach its output to bug reports.",
      .examples = {"hpsdf doctor", "hpsdf doctor --gl software"},
      .parameters = without({"cpu"}, backendParameters()),
      .action = runDoctor,
  });
}

void addScriptCommands(Registry& registry) {
  registry.addForScripts({
      .name = "set",
      .summary = "Set variables for the rest of the script.",
      .help = "In the following lines, $name or ${name} is replaced by the value. It overrides a value "
              "that was given on the command line.",
      .examples = {"set size=640x360 mesh=bunny.obj"},
      .parameters = {{"assignments", text("name=value").positional().repeatable().required(),
                      "Variables and their values."}},
      .action = runSet,
      .takesVariables = true,
      .definesVariables = true,
  });
  registry.addForScripts({
      .name = "include",
      .summary = "Insert the lines of another script.",
      .help =
          "The lines of the included script see the variables of the lines above, and variables that they set are "
          "valid in the lines below. The file is read and checked together with the script, before any command runs. A "
          "relative name starts at the folder of the including script.",
      .examples = {"include settings.hps"},
      .parameters = {{"script", file("SCRIPT").positional().required(), "File of the script."}},
      .action = runInclude,
      .includesScript = true,
  });
}

void addHelpCommands(Registry& registry) {
  registry.add({
      .name = "help",
      .summary = "Explain the program or a command.",
      .help = "Without a command it prints an overview.",
      .examples = {"hpsdf help", "hpsdf help build", "hpsdf help build --all"},
      .parameters = {{"command", text("COMMAND").positional(), "Command to explain."},
                     {"all", flag(),
                      "Explains the advanced options of the command too, as 'hpsdf COMMAND --help-all' does."}},
      .action = runHelp,
  });
  registry.add({
      .name = "docs",
      .summary = "Write the reference of all commands as a Markdown page.",
      .help = "The page docs/commands.md describes commands, parameters, ranges and defaults of this version of the "
              "program.",
      .examples = {"hpsdf docs -o docs/commands.md"},
      .parameters = {{"output", outputFile().as('o'), "File to write; standard output when left out."}},
      .action = runDocs,
  });
}

}  // namespace

void addToolCommands(Registry& registry) {
  registry.add({
      .name = "run",
      .summary = "Run a script, or script lines given with -e.",
      .help = paragraphs(R"(
A script holds one command a line: verb value key=value …, with "quotes", # comments, and ; between commands of one
line. $name or ${name} is replaced by the value that is given as name=value after the script. Relative paths start at
the current folder.

The whole script is checked before its first command runs. A mistake ends it with file:line:column. docs/scripts.md is
the manual.)"),
      .examples = {"hpsdf run pictures.hps mesh=bunny.obj", "hpsdf run -e 'build builtin:torus; slice output=x.png'"},
      .parameters = {{"script", text("SCRIPT name=value").positional().repeatable(),
                      "File of the script, then name=value for each variable. With -e only variables."},
                     {"execute", text("LINE").as('e').repeatable(), "Runs this script line instead of a file."}},
      .action = runRun,
      .takesVariables = true,
  });
  addMeshCommand(registry);
  addMachineCommands(registry);
  addScriptCommands(registry);
  addHelpCommands(registry);
}

}  // namespace hpsdf::app
