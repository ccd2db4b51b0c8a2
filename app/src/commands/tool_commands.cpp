#include <assimp/version.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <thread>

#include "commands/commands.h"
#include "console/version.h"
#include "files/text_file.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"
#include "language/help.h"
#include "language/script.h"
#include "pictures/colors_help.h"
#include "session/backend.h"
#include "session/session.h"
#include "text/json.h"

namespace hpsdf::app {
namespace {

constexpr int kMostNestedScripts = 16;

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
  std::vector<std::string> written;
  for (const Call& call : calls)
    std::ranges::copy(outputFiles(*call.command, call.arguments), std::back_inserter(written));
  requireWritten(session.console().out.flush(), written);
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

/// Returns, for each of the optional x86 instruction sets, whether this processor supports it. Returns an empty object
/// on other architectures.
Json simdOfCpu() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_cpu_init();
  return {{"sse4.2", __builtin_cpu_supports("sse4.2") != 0},
          {"avx2", __builtin_cpu_supports("avx2") != 0},
          {"avx512", __builtin_cpu_supports("avx512f") != 0}};
#else
  return Json::object();
#endif
}

std::string processorName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name") && line.find(": ") != std::string::npos) return line.substr(line.find(": ") + 2);
  return "unknown";
}

std::string compilerText() {
#if defined(__clang__)
  return fmt::format("clang {}", __clang_version__);
#elif defined(__GNUC__)
  return fmt::format("g++ {}", __VERSION__);
#else
  return "unknown";
#endif
}

/// Returns facts about the machine and about the build of the program.
Json diagnosis(const Session& session, const Arguments& arguments) {
  Json renderer, problem;
  try {
    renderer = render::glDescription(glChoice(arguments));
  } catch (const render::GlError& error) {
    problem = error.advising("with --cpu");
  } catch (const Error& error) {
    problem = error.what();
  }
  return {{"version", versionText()},
          {"compiler", compilerText()},
          {"renderer", renderer},
          {"renderer_problem", problem},
          {"processor", processorName()},
          {"simd", simdOfCpu()},
          {"simd_used", instructionSet()},
          {"threads", std::thread::hardware_concurrency()},
          {"mesh_reader", session.console().meshReader.empty() ? "this process" : "own process"},
          {"assimp", fmt::format("{}.{}.{}", aiGetVersionMajor(), aiGetVersionMinor(), aiGetVersionPatch())}};
}

std::string doctorText(const Json& found) {
  const auto textOf = [&](const char* name) { return found[name].get<std::string>(); };
  std::vector<std::string> supported;
  for (const auto& [name, isSupported] : found["simd"].items())
    if (isSupported.get<bool>()) supported.push_back(name);
  const std::pair<const char*, std::string> rows[] = {
      {"version", textOf("version")},
      {"compiler", textOf("compiler")},
      {"renderer", found["renderer"].is_null() ? "none: " + textOf("renderer_problem") : textOf("renderer")},
      {"processor", textOf("processor")},
      {"SIMD", fmt::format("{}; exact distances use {}",
                           supported.empty() ? "the baseline" : fmt::format("{}", fmt::join(supported, ", ")),
                           textOf("simd_used"))},
      {"threads", found["threads"].dump()},
      {"meshes", textOf("mesh_reader") == "own process"
                     ? "each file is read by a process of its own, with limits of time and memory"
                     : "files are read by this process, without limits: it cannot be started again"},
      {"assimp", textOf("assimp")}};
  std::string text;
  for (const auto& [name, value] : rows) text += fmt::format("{:<10} {}\n", name, value);
  return text;
}

void runDoctor(Session& session, const Arguments& arguments) {
  const Json found = diagnosis(session, arguments);
  if (session.wantsJson(arguments)) return printJson(session.console().out, found);
  session.console().out << doctorText(found);
}

void runHelp(Session& session, const Arguments& arguments) {
  std::ostream& out = session.console().out;
  const Registry& registry = session.registry();
  if (session.wantsJson(arguments)) return printJson(out, commandsJson(registry));
  const HelpDetail detail = arguments.flag("all") ? HelpDetail::all : HelpDetail::common;
  if (arguments.textOr("command", "") == "colors") {
    out << colorsHelp(session.console().showsColors);
    return;
  }
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
  writeTextFile(file, page);
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
      .summary = "Explain the program, a command, or the colours of pictures.",
      .help =
          "Without a command it prints an overview. The word colors instead of a command shows the colour maps and the "
          "colours of degrees and depths, as bars where the terminal has 24-bit colours (COLORTERM=truecolor), "
          "unless NO_COLOR is set.",
      .examples = {"hpsdf help", "hpsdf help build", "hpsdf help build --all", "hpsdf help colors"},
      .parameters = {{"command", text("COMMAND").positional(), "Command to explain, or colors."},
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
