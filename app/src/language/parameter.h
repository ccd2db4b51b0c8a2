#pragma once
// Describes the parameters of commands as rows of a table. A row holds a name, a kind and a help text, for
// example
//   {"zoom", number().above(0).byDefault("1"), "Magnification; 1 shows the whole section."}

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hpsdf::app {

enum class ParameterType : std::uint8_t {
  text,
  path,        ///< name of a file to read
  outputPath,  ///< name of a file or folder to write
  number,
  wholeNumber,
  numbers,  ///< numbers separated by commas; `ParameterKind::counts` lists how many are accepted
  choice,
  flag,
  size,  ///< WIDTHxHEIGHT
};

/// Tells when a parameter is required. `onCommandLine` is for the parameter that names a field file: scripts may omit
/// it and use the current field, but a command line starts without a current field.
enum class Need : std::uint8_t { optional, onCommandLine, always };

/// Headings for parameters that several commands have. In help texts the heading `kGeneral` comes last.
constexpr std::string_view kGeneral = "General", kFiles = "Files", kCamera = "Camera", kColours = "Colours",
                           kDrawn = "What is drawn", kPicture = "Picture";

/// The values that a parameter accepts, and the place where help texts show the parameter.
struct ParameterKind {
  ParameterType type = ParameterType::text;
  std::string valueName = {};             ///< name of the value in help texts, e.g. "FILE"; "" for the name of its type
  std::vector<std::string> choices = {};  ///< values of a `choice`, or words that `numbers` accepts instead of numbers
  std::vector<std::size_t> counts = {};   ///< accepted numbers of values for the type `numbers`
  bool whole = false;                     ///< true if `numbers` accepts whole numbers only
  std::string defaultText = {};           ///< the default as a user would write it; "" without a default
  std::string unit = {};
  std::optional<double> minimum = {};
  std::optional<double> maximum = {};
  bool minimumExcluded = false;
  bool mayBeShare = false;  ///< `number` also accepts a percentage, such as 0.02%; see `Arguments::isShare`
  char letter = 0;          ///< one-letter spelling: o for -o
  bool isPositional = false;
  bool isRepeatable = false;
  Need need = Need::optional;
  std::string synonym = {};  ///< second accepted name, which help texts prefer; "" without one
  std::string group = {};    ///< heading above the parameter in help texts; "" for "Options"
  bool isAdvanced = false;   ///< shown only in complete lists of options: --help-all, docs/commands.md

  ParameterKind& byDefault(std::string text) { return set(defaultText, std::move(text)); }
  ParameterKind& in(std::string nameOfUnit) { return set(unit, std::move(nameOfUnit)); }
  ParameterKind& atLeast(double limit) { return set(minimum, limit); }
  ParameterKind& atMost(double limit) { return set(maximum, limit); }
  ParameterKind& within(double least, double most) { return atLeast(least).atMost(most); }
  ParameterKind& above(double limit) { return atLeast(limit).set(minimumExcluded, true); }
  ParameterKind& orWords(std::vector<std::string> words) { return set(choices, std::move(words)); }
  ParameterKind& orShare() { return set(mayBeShare, true); }
  ParameterKind& as(char option) { return set(letter, option); }
  ParameterKind& alsoCalled(std::string name) { return set(synonym, std::move(name)); }
  ParameterKind& positional() { return set(isPositional, true); }
  ParameterKind& repeatable() { return set(isRepeatable, true); }
  ParameterKind& required() { return set(need, Need::always); }
  ParameterKind& requiredOnCommandLine() { return set(need, Need::onCommandLine); }
  ParameterKind& under(std::string_view heading) { return set(group, heading); }
  ParameterKind& advanced() { return set(isAdvanced, true); }

 private:
  template <typename T, typename Value>
  ParameterKind& set(T& member, Value value) {
    member = std::move(value);
    return *this;
  }
};

struct Parameter : ParameterKind {
  Parameter(std::string itsName, ParameterKind kind, std::string itsHelp)
      : ParameterKind(std::move(kind)), name(std::move(itsName)), help(std::move(itsHelp)) {}

  std::string name;
  std::string help;
};

inline ParameterKind text(std::string valueName = "") { return {ParameterType::text, std::move(valueName)}; }
inline ParameterKind file(std::string valueName = "") { return {ParameterType::path, std::move(valueName)}; }
inline ParameterKind outputFile(std::string valueName = "") {
  return {ParameterType::outputPath, std::move(valueName)};
}
inline ParameterKind number() { return {ParameterType::number}; }
inline ParameterKind wholeNumber(std::string valueName = "") {
  return {ParameterType::wholeNumber, std::move(valueName)};
}
inline ParameterKind numbers(std::string valueName, std::vector<std::size_t> counts) {
  return {ParameterType::numbers, std::move(valueName), {}, std::move(counts)};
}
inline ParameterKind wholeNumbers(std::string valueName, std::vector<std::size_t> counts) {
  return {ParameterType::numbers, std::move(valueName), {}, std::move(counts), true};
}
inline ParameterKind choice(std::vector<std::string> words) { return {ParameterType::choice, "", std::move(words)}; }
/// A parameter that is true or false. If its default is "", a command without it leaves the present setting unchanged.
inline ParameterKind flag(std::string byDefault = "false") {
  return {ParameterType::flag, "", {}, {}, false, std::move(byDefault)};
}
/// A size in pixels. Width and height must each lie between `least` and `most`.
inline ParameterKind size(double least, double most) {
  return {ParameterType::size, "", {}, {2}, true, "", "pixels", least, most};
}

/// Concatenates tables of parameters.
std::vector<Parameter> joined(std::initializer_list<std::vector<Parameter>> tables);

/// Puts the parameters under the heading `heading` in help texts.
std::vector<Parameter> under(std::string_view heading, std::vector<Parameter> parameters);

/// Returns the parameters except those whose names are in `names`.
std::vector<Parameter> without(const std::vector<std::string>& names, std::vector<Parameter> parameters);

/// Returns the parameter of this name. Throws std::logic_error if no parameter has this name.
Parameter& parameterNamed(std::string_view name, std::vector<Parameter>& parameters);

}  // namespace hpsdf::app
