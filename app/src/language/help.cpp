#include "language/help.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <sstream>

namespace hpsdf::app {
namespace {

constexpr std::size_t kWidth = 96;

/// Words of `text` in lines of at most kWidth characters, each line indented. Empty lines separate paragraphs.
std::string wrapped(const std::string& text, std::size_t indent) {
  const std::string margin(indent, ' ');
  std::istringstream lines(text);
  std::string result;
  for (std::string paragraph; std::getline(lines, paragraph);) {
    std::istringstream words(paragraph);
    std::string line;
    for (std::string word; words >> word;) {
      if (!line.empty() && indent + line.size() + 1 + word.size() > kWidth) {
        result += margin + line + "\n";
        line.clear();
      }
      line += (line.empty() ? "" : " ") + word;
    }
    result += line.empty() ? "\n" : margin + line + "\n";
  }
  return result;
}

const char* typeName(ParameterType type) {
  switch (type) {
    case ParameterType::text:
      return "TEXT";
    case ParameterType::path:
    case ParameterType::outputPath:
      return "FILE";
    case ParameterType::number:
      return "NUMBER";
    case ParameterType::wholeNumber:
      return "N";
    case ParameterType::numbers:
      return "NUMBERS";
    case ParameterType::size:
      return "WxH";
    case ParameterType::choice:
    case ParameterType::flag:
      break;
  }
  return "";
}

std::string valueName(const Parameter& parameter) {
  if (!parameter.valueName.empty()) return parameter.valueName;
  if (parameter.type == ParameterType::choice) return fmt::format("{}", fmt::join(parameter.choices, "|"));
  return typeName(parameter.type);
}

/// "-o, --output FILE"
std::string spelling(const Parameter& parameter) {
  if (parameter.positional) return valueName(parameter);
  const std::string alias = parameter.alias == 0 ? "" : fmt::format("-{}, ", parameter.alias);
  const std::string value = valueName(parameter);
  return fmt::format("{}--{}{}{}", alias, parameter.name, value.empty() ? "" : " ", value);
}

/// Range, unit and default: what the help text need not repeat.
std::string facts(const Parameter& parameter) {
  std::vector<std::string> parts;
  const bool hasRange = parameter.minimum || parameter.maximum;
  if (hasRange) parts.push_back(expectedValue(parameter));
  if (!parameter.unit.empty()) parts.push_back("in " + parameter.unit);
  if (parameter.repeatable) parts.push_back("may be repeated");
  if (parameter.need == Need::always) parts.push_back("required");
  if (parameter.need == Need::onCommandLine) parts.push_back("required on the command line");
  if (!parameter.defaultText.empty() && parameter.type != ParameterType::flag)
    parts.push_back("default " + parameter.defaultText);
  return parts.empty() ? std::string() : fmt::format("({})", fmt::join(parts, "; "));
}

std::string usage(const Command& command) {
  std::string line = command.scriptOnly ? command.name : "hpsdf " + command.name;
  for (const Parameter& parameter : command.parameters) {
    if (!parameter.positional && parameter.need == Need::optional) continue;
    std::string part =
        parameter.positional
            ? valueName(parameter)
            : fmt::format("{} {}", parameter.alias != 0 ? fmt::format("-{}", parameter.alias) : "--" + parameter.name,
                          valueName(parameter));
    if (parameter.repeatable) part += " …";
    line += parameter.need == Need::optional ? " [" + part + "]" : " " + part;
  }
  return line + " [options]";
}

}  // namespace

std::string overviewHelp(const Registry& registry) {
  std::string text =
      "hpsdf turns a triangle mesh into a hierarchical hp-adaptive signed distance field: an octree whose leaves hold\n"
      "polynomials of degree 1 to 30, refined where the distance asks for it, until the error falls below a target.\n"
      "\n"
      "A first session:\n"
      "  hpsdf build bunny.obj -o bunny.hpsdf               from a mesh to a field, once\n"
      "  hpsdf info bunny.hpsdf                             what it holds, how exact it is\n"
      "  hpsdf slice bunny.hpsdf -o degree.png              a plane through it\n"
      "  hpsdf render bunny.hpsdf -o surface.png            its surface\n"
      "  echo 0.1 0.2 0.3 | hpsdf query bunny.hpsdf         distance and gradient at a point\n"
      "  hpsdf report builtin:torus -o torus                all of that on one page, no file needed\n"
      "\n"
      "Commands:\n";
  for (const Command& command : registry.commands())
    if (!command.scriptOnly) text += fmt::format("  {:<9} {}\n", command.name, command.summary);
  text += "\nIn scripts also:\n";
  for (const Command& command : registry.commands())
    if (command.scriptOnly) text += fmt::format("  {:<9} {}\n", command.name, command.summary);
  text +=
      "\n'hpsdf help COMMAND' or 'hpsdf COMMAND --help' explains a command and its options; 'hpsdf --version' tells "
      "the "
      "version.\nA script writes an option --name value as name=value. Exit status: 0 done, 1 a comparison failed, 2 "
      "bad "
      "input, 3 some\nmeshes of a batch failed, 130 cancelled.\n";
  return text;
}

std::string commandHelp(const Command& command) {
  std::string text = fmt::format("{}\n\nUsage: {}\n\n{}", command.summary, usage(command), wrapped(command.help, 0));
  text += command.examples.size() == 1 ? "\nExample:\n" : "\nExamples:\n";
  for (const std::string& example : command.examples) text += "  " + example + "\n";
  text += "\nParameters:\n";
  for (const Parameter& parameter : command.parameters) {
    const std::string detail = facts(parameter);
    text += "  " + spelling(parameter) + "\n" + wrapped(parameter.help + (detail.empty() ? "" : " " + detail), 6);
  }
  return text;
}

std::string commandsMarkdown(const Registry& registry) {
  std::string text =
      "# Commands\n\n"
      "Written by `hpsdf docs`, from the registry that the program itself reads. In a script an option\n"
      "`--name value` is written `name=value` (see [scripts.md](scripts.md)).\n";
  for (const Command& command : registry.commands()) {
    text += fmt::format("\n## {}\n\n{}{}\n\n```\n{}\n```\n\n{}\n", command.name, command.summary,
                        command.scriptOnly        ? " In scripts only."
                        : command.commandLineOnly ? " On the command line only."
                                                  : "",
                        usage(command), command.help);
    text += fmt::format("\n```sh\n{}\n```\n", fmt::join(command.examples, "\n"));
    text += "\n| parameter | |\n|---|---|\n";
    for (const Parameter& parameter : command.parameters) {
      std::string cell = spelling(parameter);
      for (std::size_t at = 0; (at = cell.find('|', at)) != std::string::npos; at += 2) cell.insert(at, "\\");
      const std::string detail = facts(parameter);
      text += fmt::format("| `{}` | {}{}{} |\n", cell, parameter.help, detail.empty() ? "" : " ", detail);
    }
  }
  return text;
}

nlohmann::ordered_json commandsJson(const Registry& registry) {
  nlohmann::ordered_json commands = nlohmann::ordered_json::array();
  for (const Command& command : registry.commands()) {
    nlohmann::ordered_json parameters = nlohmann::ordered_json::array();
    for (const Parameter& parameter : command.parameters)
      parameters.push_back({{"name", parameter.name},
                            {"expected", expectedValue(parameter)},
                            {"default", parameter.defaultText},
                            {"unit", parameter.unit},
                            {"positional", parameter.positional},
                            {"repeatable", parameter.repeatable},
                            {"help", parameter.help}});
    commands.push_back({{"name", command.name},
                        {"summary", command.summary},
                        {"script_only", command.scriptOnly},
                        {"command_line_only", command.commandLineOnly},
                        {"help", command.help},
                        {"examples", command.examples},
                        {"parameters", parameters}});
  }
  return commands;
}

}  // namespace hpsdf::app
