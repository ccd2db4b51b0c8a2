#include "language/registry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "hpsdf/detail/nearest_name.h"

namespace hpsdf::app {
namespace {

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::vector<std::string> namesOf(const auto& described) {
  std::vector<std::string> names;
  for (const auto& one : described) names.push_back(one.name);
  return names;
}

bool inRange(const Parameter& parameter, double value) {
  if (parameter.minimum && (value < *parameter.minimum || (parameter.minimumExcluded && value == *parameter.minimum)))
    return false;
  return !parameter.maximum || value <= *parameter.maximum;
}

std::string rangeText(const Parameter& parameter) {
  if (parameter.minimum && parameter.maximum && parameter.minimumExcluded)
    return fmt::format(" above {}, up to {}", *parameter.minimum, *parameter.maximum);
  if (parameter.minimum && parameter.maximum)
    return fmt::format(" from {} to {}", *parameter.minimum, *parameter.maximum);
  if (parameter.minimum)
    return fmt::format(" {} {}", parameter.minimumExcluded ? "above" : "of at least", *parameter.minimum);
  if (parameter.maximum) return fmt::format(" of at most {}", *parameter.maximum);
  return {};
}

std::string joinedWithOr(const std::vector<std::string>& words) {
  if (words.size() < 2) return fmt::format("{}", fmt::join(words, ""));
  return fmt::format("{} or {}", fmt::join(words.begin(), words.end() - 1, ", "), words.back());
}

bool contains(const std::vector<std::string>& words, std::string_view word) {
  return std::ranges::find(words, word) != words.end();
}

std::optional<bool> parseFlag(std::string_view text) {
  if (text == "true" || text == "on" || text == "yes" || text == "1") return true;
  if (text == "false" || text == "off" || text == "no" || text == "0") return false;
  return std::nullopt;
}

/// Returns texts that say how many values a parameter accepts: "a number", "3 numbers with commas between them".
/// Consecutive counts share one text, such as "2 to 4 numbers with commas between them".
std::vector<std::string> countForms(const Parameter& parameter) {
  const char* kind = parameter.whole ? "whole number" : "number";
  std::vector<std::string> forms;
  for (std::size_t n = 0; n < parameter.counts.size(); ++n) {
    const std::size_t first = parameter.counts[n];
    while (n + 1 < parameter.counts.size() && parameter.counts[n + 1] == parameter.counts[n] + 1) ++n;
    const std::size_t last = parameter.counts[n];
    if (last == 1)
      forms.push_back(fmt::format("a {}", kind));
    else if (first == last)
      forms.push_back(fmt::format("{} {}s with commas between them", first, kind));
    else
      forms.push_back(fmt::format("{} to {} {}s with commas between them", first, last, kind));
  }
  return forms;
}

/// Parses the value of a parameter as numbers. Returns std::nullopt if the parameter does not accept the text.
std::optional<std::vector<double>> parseNumbers(const Parameter& parameter, std::string_view text) {
  const bool whole = parameter.whole || parameter.type == ParameterType::wholeNumber;
  std::vector<double> numbers;
  for (const std::string_view part : split(text, parameter.type == ParameterType::size ? 'x' : ',')) {
    const bool isShare = parameter.mayBeShare && part.ends_with('%');
    const auto number = parseNumber(part.substr(0, part.size() - (isShare ? 1 : 0)));
    if (!number || !inRange(parameter, *number) || (whole && *number != std::floor(*number))) return std::nullopt;
    numbers.push_back(isShare ? *number / 100 : *number);
  }
  const std::vector<std::size_t> one = {1};
  const auto& counts =
      parameter.type == ParameterType::numbers || parameter.type == ParameterType::size ? parameter.counts : one;
  if (std::ranges::find(counts, numbers.size()) == counts.end()) return std::nullopt;
  return numbers;
}

}  // namespace

std::optional<double> parseNumber(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::string expectedValue(const Parameter& parameter) {
  switch (parameter.type) {
    case ParameterType::text:
      return "a text";
    case ParameterType::path:
    case ParameterType::outputPath:
      return "a file name";
    case ParameterType::number:
      return "a number" + rangeText(parameter) + (parameter.mayBeShare ? ", or a percentage" : "");
    case ParameterType::wholeNumber:
      return "a whole number" + rangeText(parameter);
    case ParameterType::choice:
      return joinedWithOr(parameter.choices);
    case ParameterType::flag:
      return "true or false";
    case ParameterType::size:
      return "WIDTHxHEIGHT, each" + rangeText(parameter);
    case ParameterType::numbers:
      break;
  }
  std::vector<std::string> forms = parameter.choices;
  for (std::string& form : countForms(parameter)) forms.push_back(std::move(form));
  return joinedWithOr(forms) + (parameter.minimum ? ", each" + rangeText(parameter) : std::string());
}

const Parameter* findParameter(const Command& command, std::string_view name) {
  const auto found = std::ranges::find_if(command.parameters, [&](const Parameter& parameter) {
    return parameter.name == name || (!parameter.synonym.empty() && parameter.synonym == name);
  });
  return found == command.parameters.end() ? nullptr : &*found;
}

std::vector<Parameter> joined(std::initializer_list<std::vector<Parameter>> tables) {
  std::vector<Parameter> parameters;
  for (const std::vector<Parameter>& table : tables) parameters.insert(parameters.end(), table.begin(), table.end());
  return parameters;
}

std::vector<Parameter> under(std::string_view heading, std::vector<Parameter> parameters) {
  for (Parameter& parameter : parameters) parameter.under(heading);
  return parameters;
}

std::vector<Parameter> without(const std::vector<std::string>& names, std::vector<Parameter> parameters) {
  std::erase_if(parameters, [&](const Parameter& parameter) { return contains(names, parameter.name); });
  return parameters;
}

Parameter& parameterNamed(std::string_view name, std::vector<Parameter>& parameters) {
  const auto found = std::ranges::find(parameters, name, &Parameter::name);
  if (found == parameters.end()) throw std::logic_error(fmt::format("no parameter '{}' in the table", name));
  return *found;
}

std::string paragraphs(std::string_view text) {
  if (text.starts_with('\n')) text.remove_prefix(1);
  std::string result(text);
  for (std::size_t i = 1; i + 1 < result.size(); ++i)
    if (result[i] == '\n' && result[i - 1] != '\n' && result[i + 1] != '\n') result[i] = ' ';
  return result;
}

void Registry::add(Command command) {
  if (std::ranges::find(commands_, command.name, &Command::name) != commands_.end())
    throw std::logic_error("two commands named " + command.name);
  command.parameters.push_back(
      {"json", flag().under(kGeneral),
       "Writes the results as JSON to standard output, and nothing else. Use it in programs that call hpsdf."});
  commands_.push_back(std::move(command));
}

void Registry::addForScripts(Command command) {
  command.scriptOnly = true;
  add(std::move(command));
}

const Command& Registry::command(std::string_view name) const {
  const auto found = std::ranges::find(commands_, name, &Command::name);
  if (found != commands_.end()) return *found;
  throw Error(
      fmt::format("unknown command '{}'; {}", name, didYouMean(name, namesOf(commands_), "'hpsdf --help' lists them")));
}

/// Builds the `Arguments` of one call of a command from its words. The library CLI11 separates options, their values
/// and positional words.
class ArgumentReader {
 public:
  ArgumentReader(const Command& command, std::span<const Word> words, Origin origin)
      : command_(command), words_(words), origin_(origin) {}

  Arguments read() {
    CLI::App parser;
    parser.set_help_flag();
    parser.allow_extras();
    std::vector<CLI::Option*> options;
    for (const Parameter& parameter : command_.parameters) options.push_back(addOption(parser, parameter));
    try {
      std::vector<std::string> reversed = normalizedWords();
      std::ranges::reverse(reversed);
      parser.parse(reversed);
    } catch (const CLI::ArgumentMismatch&) {
      throw ArgumentError(fmt::format("{}: needs a value", words_.back().text), words_.size() - 1);
    } catch (const CLI::Error& error) {
      throw ArgumentError(error.what(), 0);
    }
    refuseUnknown(parser.remaining());
    for (std::size_t i = 0; i < options.size(); ++i) take(command_.parameters[i], options[i]->results());
    return std::move(arguments_);
  }

 private:
  static CLI::Option* addOption(CLI::App& parser, const Parameter& parameter) {
    std::string names = "--" + parameter.name;
    if (!parameter.synonym.empty()) names += ",--" + parameter.synonym;
    if (parameter.letter != 0) names += fmt::format(",-{}", parameter.letter);
    if (parameter.type == ParameterType::flag)
      return parser.add_flag(names)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    if (parameter.isPositional) names += "," + parameter.name;
    CLI::Option* option = parser.add_option(names);
    if (parameter.isRepeatable) option->expected(1, CLI::detail::expected_max_vector_size);
    // Each occurrence of an option takes only one value: in `-e A B` the word B remains a positional word.
    option->allow_extra_args(parameter.isRepeatable && parameter.isPositional);
    return option->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  }

  /// Returns a word as CLI11 takes it: a number or a list of numbers that begins with -. as in -.5, which CLI11 takes
  /// for an option, with -0. instead.
  static std::string normalizedWord(const std::string& word) {
    const bool isNumber = word.size() > 2 && word.starts_with("-.") && word[2] >= '0' && word[2] <= '9' &&
                          word.find_first_not_of("0123456789+-.eE,") == std::string::npos;
    return isNumber ? "-0" + word.substr(1) : word;
  }

  /// Converts the words of a script from the spelling name=value to --name=value. A value with blanks stays
  /// part of one word.
  std::vector<std::string> normalizedWords() const {
    std::vector<std::string> result;
    for (std::size_t i = 0; i < words_.size(); ++i) {
      const Word& word = words_[i];
      if (origin_ == Origin::commandLine || word.equals == std::string::npos) {
        result.push_back(normalizedWord(word.text));
        continue;
      }
      const std::string name = word.text.substr(0, word.equals);
      const bool known = findParameter(command_, name) != nullptr;
      if (!known && command_.takesVariables) {
        result.push_back(word.text);
        continue;
      }
      if (!known) throw unknownOption(name, name, i);
      if (word.equals + 1 == word.text.size()) throw ArgumentError(fmt::format("{}: needs a value", name), i);
      result.push_back("--" + word.text);
    }
    return result;
  }

  ArgumentError unknownOption(const std::string& written, std::string_view name, std::size_t word) const {
    const std::string list = fmt::format("'hpsdf help {} --all' lists them", command_.name);
    return ArgumentError(
        fmt::format("{}: unknown option '{}'; {}", command_.name, written,
                    didYouMean(name, namesOf(command_.parameters), list, origin_ == Origin::commandLine ? "--" : "")),
        word);
  }

  void refuseUnknown(const std::vector<std::string>& extras) const {
    // Find the unknown option among the words that the parser left over. The option's value may be left over too, but
    // the error must name the option.
    const auto option = std::ranges::find_if(extras, [](const std::string& word) { return word.starts_with('-'); });
    if (option != extras.end()) {
      const std::string written = option->substr(0, option->find('='));
      throw unknownOption(written, std::string_view(written).substr(written.find_first_not_of('-') % written.size()),
                          wordIndex(*option));
    }
    if (!extras.empty())
      throw ArgumentError(fmt::format("{}: unexpected '{}'; 'hpsdf help {}' says what it takes", command_.name,
                                      extras.front(), command_.name),
                          wordIndex(extras.front()));
  }

  std::size_t wordIndex(std::string_view text) const {
    const auto found = std::ranges::find(words_, text, [](const Word& word) { return normalizedWord(word.text); });
    return found == words_.end() ? 0 : static_cast<std::size_t>(found - words_.begin());
  }

  /// Returns the index of the last word that sets the parameter. Error messages about the parameter's value
  /// point to this word.
  std::size_t wordOf(const Parameter& parameter, std::string_view value) const {
    for (std::size_t i = words_.size(); i-- > 0;) {
      const std::string_view text = words_[i].text;
      const bool aliased = parameter.letter != 0 && text.starts_with(fmt::format("-{}", parameter.letter));
      if (isNamedIn(words_[i], parameter) || aliased ||
          (parameter.isPositional && normalizedWord(words_[i].text) == value))
        return i;
    }
    return 0;
  }

  /// True if the word sets the parameter by its name or by its synonym.
  static bool isNamedIn(const Word& word, const Parameter& parameter) {
    return sets(word, parameter.name) || (!parameter.synonym.empty() && sets(word, parameter.synonym));
  }

  /// True if the word sets the option `name`, as `name=value`, `--name` or `--name=value`.
  static bool sets(const Word& word, const std::string& name) {
    const std::string_view text = word.text;
    const std::string option = "--" + name;
    if (text.starts_with(option) && (text.size() == option.size() || text[option.size()] == '=')) return true;
    return word.equals != std::string::npos && text.substr(0, word.equals) == name;
  }

  std::string shown(const Parameter& parameter) const {
    return origin_ == Origin::commandLine && !parameter.isPositional ? "--" + parameter.name : parameter.name;
  }

  void take(const Parameter& parameter, const std::vector<std::string>& results) {
    if (results.size() > 1 && !parameter.isRepeatable)
      throw ArgumentError(fmt::format("{}: given {} times; once is enough", shown(parameter), results.size()),
                          wordOf(parameter, results.back()));
    Arguments::Entry entry;
    entry.given = !results.empty();
    entry.named = std::ranges::any_of(words_, [&](const Word& word) { return isNamedIn(word, parameter); });
    for (const std::string& text : results) entry.values.push_back(checked(parameter, text));
    const bool needed =
        parameter.need == Need::always || (parameter.need == Need::onCommandLine && origin_ == Origin::commandLine);
    if (!entry.given && needed)
      throw ArgumentError(
          fmt::format("{}: {} is missing; 'hpsdf help {}' explains", command_.name, shown(parameter), command_.name),
          words_.size());
    if (!entry.given && !parameter.defaultText.empty())
      entry.values.push_back(checked(parameter, parameter.defaultText));
    arguments_.entries_.emplace(parameter.name, std::move(entry));
  }

  Arguments::Value checked(const Parameter& parameter, const std::string& text) const {
    Arguments::Value value{.text = text};
    const auto refuse = [&](const std::string& hint = {}) {
      throw ArgumentError(fmt::format("{}: expected {}, found '{}'{}{}", shown(parameter), expectedValue(parameter),
                                      text, hint.empty() ? "" : "; ", hint),
                          wordOf(parameter, text));
    };
    switch (parameter.type) {
      case ParameterType::text:
      case ParameterType::path:
      case ParameterType::outputPath:
        if (text.empty()) refuse();
        break;
      case ParameterType::choice:
        if (!contains(parameter.choices, text)) refuse(didYouMean(text, parameter.choices, ""));
        break;
      case ParameterType::flag:
        if (const auto on = parseFlag(text))
          value.numbers = {*on ? 1.0 : 0.0};
        else
          refuse();
        break;
      case ParameterType::number:
      case ParameterType::wholeNumber:
      case ParameterType::numbers:
      case ParameterType::size:
        if (contains(parameter.choices, text)) break;
        value.isShare = parameter.mayBeShare && text.ends_with('%');
        if (auto numbers = parseNumbers(parameter, text))
          value.numbers = std::move(*numbers);
        else
          refuse(didYouMean(text, parameter.choices, ""));
        break;
    }
    return value;
  }

  const Command& command_;
  std::span<const Word> words_;
  Origin origin_;
  Arguments arguments_;
};

Arguments parseArguments(const Command& command, std::span<const Word> words, Origin origin) {
  Arguments arguments = ArgumentReader(command, words, origin).read();
  if (command.check) command.check(arguments);
  return arguments;
}

const Arguments::Entry& Arguments::entry(std::string_view name) const {
  const auto found = entries_.find(name);
  if (found == entries_.end()) throw std::logic_error(fmt::format("no parameter '{}' in the registry", name));
  return found->second;
}

const Arguments::Value& Arguments::single(std::string_view name) const {
  const Entry& found = entry(name);
  if (found.values.empty()) throw std::logic_error(fmt::format("parameter '{}' has no value", name));
  return found.values.front();
}

bool Arguments::given(std::string_view name) const { return entry(name).given; }
bool Arguments::has(std::string_view name) const { return !entry(name).values.empty(); }
bool Arguments::named(std::string_view name) const { return entry(name).named; }
std::string Arguments::text(std::string_view name) const { return single(name).text; }
std::string Arguments::textOr(std::string_view name, std::string fallback) const {
  return has(name) ? text(name) : std::move(fallback);
}
double Arguments::number(std::string_view name) const { return single(name).numbers.at(0); }
bool Arguments::isShare(std::string_view name) const { return has(name) && single(name).isShare; }
int Arguments::whole(std::string_view name) const { return static_cast<int>(number(name)); }
std::vector<double> Arguments::numbers(std::string_view name) const {
  std::vector<double> all;
  for (const Value& value : entry(name).values) all.insert(all.end(), value.numbers.begin(), value.numbers.end());
  return all;
}
bool Arguments::flag(std::string_view name) const { return number(name) != 0; }

std::array<int, 2> Arguments::size(std::string_view name) const {
  const auto& numbers = single(name).numbers;
  return {static_cast<int>(numbers.at(0)), static_cast<int>(numbers.at(1))};
}

std::vector<std::string> Arguments::texts(std::string_view name) const {
  std::vector<std::string> result;
  for (const Value& value : entry(name).values) result.push_back(value.text);
  return result;
}

std::vector<std::string> outputFiles(const Command& command, const Arguments& arguments) {
  std::vector<std::string> files;
  for (const Parameter& parameter : command.parameters)
    if (parameter.type == ParameterType::outputPath && !parameter.isRepeatable && arguments.given(parameter.name))
      files.push_back(arguments.text(parameter.name));
  return files;
}

}  // namespace hpsdf::app
