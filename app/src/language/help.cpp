#include "language/help.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <sstream>
#include <utility>
#include <vector>

namespace hpsdf::app {
namespace {

constexpr std::size_t kWidth = 96;

/// Breaks `text` into lines of at most kWidth bytes and indents each line by `indent` blanks. Empty lines in
/// `text` separate paragraphs.
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

/// Returns a parameter with its option letter, name and value, as in "-o, --output FILE".
std::string spelling(const Parameter& parameter) {
  if (parameter.isPositional) return valueName(parameter);
  const std::string alias = parameter.letter == 0 ? "" : fmt::format("-{}, ", parameter.letter);
  const std::string value = valueName(parameter);
  return fmt::format("{}--{}{}{}", alias, parameter.synonym.empty() ? parameter.name : parameter.synonym,
                     value.empty() ? "" : " ", value);
}

/// Returns the range, unit, default and alternative name of a parameter in parentheses, so that its help text need not
/// repeat them.
std::string facts(const Parameter& parameter) {
  std::vector<std::string> parts;
  const bool hasRange = parameter.minimum || parameter.maximum;
  if (hasRange) parts.push_back(expectedValue(parameter));
  if (!parameter.unit.empty()) parts.push_back("in " + parameter.unit);
  if (parameter.isRepeatable) parts.push_back("may be repeated");
  if (parameter.need == Need::always) parts.push_back("required");
  if (parameter.need == Need::onCommandLine) parts.push_back("required on the command line");
  if (!parameter.defaultText.empty() && parameter.type != ParameterType::flag)
    parts.push_back("default " + parameter.defaultText);
  if (!parameter.synonym.empty()) parts.push_back(fmt::format("also --{}", parameter.name));
  return parts.empty() ? std::string() : fmt::format(" ({})", fmt::join(parts, "; "));
}

std::string usage(const Command& command) {
  std::string line = command.scriptOnly ? command.name : "hpsdf " + command.name;
  for (const Parameter& parameter : command.parameters) {
    if (!parameter.isPositional && parameter.need == Need::optional) continue;
    std::string part =
        parameter.isPositional
            ? valueName(parameter)
            : fmt::format("{} {}", parameter.letter != 0 ? fmt::format("-{}", parameter.letter) : "--" + parameter.name,
                          valueName(parameter));
    if (parameter.isRepeatable) part += " …";
    line += parameter.need == Need::optional ? " [" + part + "]" : " " + part;
  }
  return line + " [options]";
}

std::string headingOf(const Parameter& parameter) {
  if (parameter.isPositional) return "Arguments";
  return parameter.group.empty() ? "Options" : parameter.group;
}

struct Group {
  std::string heading;
  std::vector<const Parameter*> parameters = {};
};

/// Groups parameters by their headings. The groups appear in the order in which their headings first occur;
/// the group `kGeneral` comes last.
std::vector<Group> byGroup(const std::vector<Parameter>& parameters) {
  std::vector<Group> groups;
  for (const Parameter& parameter : parameters) {
    const std::string heading = headingOf(parameter);
    auto group = std::ranges::find(groups, heading, &Group::heading);
    if (group == groups.end()) group = groups.insert(group, {heading});
    group->parameters.push_back(&parameter);
  }
  std::stable_partition(groups.begin(), groups.end(), [](const Group& group) { return group.heading != kGeneral; });
  return groups;
}

/// The place in docs/commands.md where an option of a command is described: with the command itself, with the command
/// `build`, or in the section of shared options.
enum class DescribedAt : std::uint8_t { here, build, sharedOptions };

bool isSameOption(const Parameter& a, const Parameter& b) { return a.name == b.name && a.help == b.help; }

DescribedAt describedAt(const Registry& registry, const Command& command, const Parameter& parameter) {
  std::size_t commands = 0;
  bool inBuild = false;
  for (const Command& other : registry.commands())
    for (const Parameter& one : other.parameters)
      if (isSameOption(one, parameter)) {
        ++commands;
        inBuild = inBuild || other.name == "build";
      }
  if (commands == 1) return DescribedAt::here;
  if (!inBuild || commands == registry.commands().size()) return DescribedAt::sharedOptions;
  return command.name == "build" ? DescribedAt::here : DescribedAt::build;
}

std::string markdownRows(const std::string& heading, const std::vector<const Parameter*>& parameters) {
  if (parameters.empty()) return {};
  std::string text = fmt::format("\n| {} | |\n|---|---|\n", heading);
  for (const Parameter* parameter : parameters) {
    std::string cell = spelling(*parameter);
    for (std::size_t i = 0; (i = cell.find('|', i)) != std::string::npos; i += 2) cell.insert(i, "\\");
    text += fmt::format("| `{}` | {}{} |\n", cell, parameter->help, facts(*parameter));
  }
  return text;
}

std::string markdownNames(const std::vector<const Parameter*>& parameters) {
  std::vector<std::string> names;
  for (const Parameter* parameter : parameters)
    names.push_back(fmt::format("`{}{}`", parameter->isPositional ? valueName(*parameter) : "--" + parameter->name,
                                parameter->isRepeatable ? " …" : ""));
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Returns the parameters of a command as Markdown: descriptions of the parameters that only this command has, by
/// group, and references to the descriptions of the parameters that it shares with other commands.
std::string markdownParameters(const Registry& registry, const Command& command) {
  std::string text;
  std::vector<const Parameter*> shared;
  for (const Group& group : byGroup(command.parameters)) {
    std::vector<const Parameter*> own, ofBuild;
    for (const Parameter* parameter : group.parameters) {
      const DescribedAt where = describedAt(registry, command, *parameter);
      (where == DescribedAt::here ? own : where == DescribedAt::build ? ofBuild : shared).push_back(parameter);
    }
    text += markdownRows(group.heading, own);
    if (!ofBuild.empty())
      text += fmt::format("\n{}, see [build](#build): {}.\n", group.heading, markdownNames(ofBuild));
  }
  if (!shared.empty()) text += fmt::format("\n[Shared options](#shared-options): {}.\n", markdownNames(shared));
  return text;
}

std::string markdownSharedOptions(const Registry& registry) {
  std::vector<Parameter> shared;
  for (const Command& command : registry.commands())
    for (const Parameter& parameter : command.parameters)
      if (describedAt(registry, command, parameter) == DescribedAt::sharedOptions &&
          std::ranges::none_of(shared, [&](const Parameter& other) { return isSameOption(other, parameter); }))
        shared.push_back(parameter);
  std::string text;
  for (const Group& group : byGroup(shared)) text += markdownRows(group.heading, group.parameters);
  return text;
}

}  // namespace

std::string overviewHelp(const Registry& registry) {
  std::string text =
      R"(hpsdf turns a triangle mesh into a hierarchical hp-adaptive signed distance field: an octree whose leaves hold
polynomials of degree 1 to 30. It is refined where the distance requires it, until the error falls below a target.

A first session:
  hpsdf build bunny.obj -o bunny.hpsdf               build a field from a mesh, once
  hpsdf info bunny.hpsdf                             see its size, its settings and its error
  hpsdf slice bunny.hpsdf -o degree.png              draw a plane through it
  hpsdf render bunny.hpsdf -o surface.png            draw its surface
  hpsdf query bunny.hpsdf 0.1,0.2,0.3                compute distance and gradient at a point
  hpsdf report builtin:torus -o torus                do all of this for a built-in shape, on one page
  hpsdf bunny.hpsdf                                  look at it in a window, as 'hpsdf view' does

Commands:
)";
  for (const bool scriptOnly : {false, true}) {
    if (scriptOnly) text += "\nCommands of scripts only:\n";
    for (const Command& command : registry.commands())
      if (command.scriptOnly == scriptOnly) text += fmt::format("  {:<9} {}\n", command.name, command.summary);
  }
  return text + R"(
'hpsdf help COMMAND' or 'hpsdf COMMAND --help' explains a command and its common options, 'hpsdf COMMAND --help-all'
all of its options. 'hpsdf help colors' shows the colours of pictures, 'hpsdf --version' prints the version. A script writes an option --name value as name=value.
Exit status: 0 done, 1 a comparison failed, 2 bad input, 3 some meshes of a batch failed; after a signal 128 + its
number: 130 Ctrl-C, 143 SIGTERM, 129 SIGHUP, 141 the reader of standard output has gone.
)";
}

std::string commandHelp(const Command& command, HelpDetail detail) {
  std::string text = fmt::format("{}\n\nUsage: {}\n\n{}", command.summary, usage(command), wrapped(command.help, 0));
  text += command.examples.size() == 1 ? "\nExample:\n" : "\nExamples:\n";
  for (const std::string& example : command.examples) text += "  " + example + "\n";
  std::size_t hidden = 0;
  for (const Group& group : byGroup(command.parameters)) {
    std::string options;
    for (const Parameter* parameter : group.parameters)
      if (detail == HelpDetail::all || !parameter->isAdvanced)
        options += "  " + spelling(*parameter) + "\n" + wrapped(parameter->help + facts(*parameter), 6);
      else
        ++hidden;
    if (!options.empty()) text += "\n" + group.heading + ":\n" + options;
  }
  if (hidden > 0)
    text += fmt::format("\n'hpsdf {} --help-all' also explains {} advanced options.\n", command.name, hidden);
  return text;
}

std::string commandsMarkdown(const Registry& registry) {
  std::string text =
      "# Commands\n\n"
      "`hpsdf docs` writes this page from the registry that the program itself reads. A script writes an option\n"
      "`--name value` as `name=value` (see [scripts.md](scripts.md)).\n\n"
      "| command | |\n|---|---|\n";
  for (const Command& command : registry.commands())
    text += fmt::format("| [{0}](#{0}) | {1} |\n", command.name, command.summary);
  text += "\n## Shared options\n\nSeveral commands have these options; each command lists which.\n";
  text += markdownSharedOptions(registry);
  for (const Command& command : registry.commands()) {
    const char* const where = command.scriptOnly        ? " In scripts only."
                              : command.commandLineOnly ? " On the command line only."
                                                        : "";
    text += fmt::format("\n## {}\n\n{}{}\n\n```\n{}\n```\n\n{}\n", command.name, command.summary, where, usage(command),
                        command.help);
    text += fmt::format("\n```sh\n{}\n```\n", fmt::join(command.examples, "\n"));
    text += markdownParameters(registry, command);
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
                            {"positional", parameter.isPositional},
                            {"repeatable", parameter.isRepeatable},
                            {"group", parameter.group},
                            {"advanced", parameter.isAdvanced},
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
