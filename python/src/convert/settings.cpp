#include "convert/settings.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/nearest_name.h"

namespace py = pybind11;

namespace hpsdf::python {
namespace {

using Ending = BuildSetting::Ending;
using Type = BuildSetting::Type;

std::string pythonName(const BuildSetting& setting) {
  std::string name(setting.name);
  std::ranges::replace(name, '-', '_');
  return name;
}

[[noreturn]] void refuse(const BuildSetting& setting, const std::string& problem) {
  throw Error(ErrorKind::option, pythonName(setting), problem);
}

/// Returns the value that is given to a setting, or None.
py::object given(const py::kwargs& arguments, const BuildSetting& setting) {
  const std::string name = pythonName(setting);
  return arguments.contains(name) ? py::object(arguments[name.c_str()]) : py::none();
}

bool isAnyGiven(const py::kwargs& arguments, std::initializer_list<Ending> endings) {
  return std::ranges::any_of(buildSettings(), [&](const BuildSetting& setting) {
    return std::ranges::find(endings, setting.ending) != endings.end() && !given(arguments, setting).is_none();
  });
}

void requireKnownNames(const py::kwargs& arguments) {
  std::vector<std::string> known;
  for (const BuildSetting& setting : buildSettings())
    if (setting.isOffered) known.push_back(pythonName(setting));
  for (const auto& [key, value] : arguments) {
    const auto name = key.cast<std::string>();
    if (std::ranges::find(known, name) == known.end())
      throw py::type_error("build() has no option '" + name +
                           "': " + didYouMean(name, known, "help(hpsdf.build) lists all options"));
  }
}

/// Returns the number that a percentage of the longest side stands for: "0.02%".
double shareOf(const BuildSetting& setting, const std::string& text, double longestSide) {
  std::istringstream stream(text);
  double percent = 0;
  std::string rest;
  if (!setting.mayBeShare || !(stream >> percent >> rest) || rest != "%" || !(stream >> std::ws).eof())
    refuse(setting, std::string("expected a number") +
                        (setting.mayBeShare ? " or a percentage of the mesh's longest side, such as '0.02%'" : "") +
                        ", got '" + text + "'");
  return percent / 100 * longestSide;
}

double numberOf(const BuildSetting& setting, const py::handle& value, double longestSide) {
  if (py::isinstance<py::str>(value)) return shareOf(setting, value.cast<std::string>(), longestSide);
  const double number = PyFloat_AsDouble(value.ptr());
  if (number == -1 && PyErr_Occurred() != nullptr) {
    PyErr_Clear();
    throw py::type_error(pythonName(setting) + ": expected a number");
  }
  const bool isWhole = setting.type == Type::wholeNumber || setting.type == Type::wholeNumbers;
  const bool aboveMinimum = setting.minimumExcluded ? number > setting.minimum : number >= setting.minimum;
  if (std::isfinite(number) && aboveMinimum && number <= setting.maximum && (!isWhole || number == std::floor(number)))
    return number;
  std::ostringstream range;
  range << "expected a " << (isWhole ? "whole " : "") << "number";
  if (std::isfinite(setting.minimum)) range << (setting.minimumExcluded ? " above " : " from ") << setting.minimum;
  if (std::isfinite(setting.maximum)) range << " up to " << setting.maximum;
  range << ", got " << number;
  refuse(setting, range.str());
}

double wordOf(const BuildSetting& setting, const py::handle& value) {
  const std::vector<std::string> words(setting.words.begin(), setting.words.end());
  if (!py::isinstance<py::str>(value)) throw py::type_error(pythonName(setting) + ": expected a string");
  const auto word = value.cast<std::string>();
  const auto found = std::ranges::find(words, word);
  if (found != words.end()) return static_cast<double>(found - words.begin());
  std::string all;
  for (const std::string& each : words) all += (all.empty() ? "'" : ", '") + each + "'";
  refuse(setting, "there is no '" + word + "': " + didYouMean(word, words, "expected one of " + all));
}

std::vector<double> valueOf(const BuildSetting& setting, const py::object& value, double longestSide) {
  if (setting.type == Type::choice) return {wordOf(setting, value)};
  if (setting.type == Type::flag) {
    if (!py::isinstance<py::bool_>(value)) throw py::type_error(pythonName(setting) + ": expected True or False");
    return {value.cast<bool>() ? 1.0 : 0.0};
  }
  if (setting.type != Type::wholeNumbers || !py::isinstance<py::sequence>(value))
    return {numberOf(setting, value, longestSide)};
  std::vector<double> numbers;
  for (const py::handle& item : value) numbers.push_back(numberOf(setting, item, longestSide));
  if (numbers.size() != 1 && numbers.size() != 3) refuse(setting, "expected one number or three");
  return numbers;
}

/// Throws `Error` if a setting that is given cannot be given together with the others.
void requireCompanions(const py::kwargs& arguments, const BuildSetting& setting, const BuildOptions& options) {
  if (!setting.exclusive.empty() && !given(arguments, buildSetting(setting.exclusive)).is_none())
    refuse(setting, "cannot be given together with " + pythonName(buildSetting(setting.exclusive)));
  if (setting.hasOwner != nullptr && !setting.hasOwner(options))
    refuse(setting, "has no effect without " + std::string(setting.owner));
  const bool isTolerant = !given(arguments, buildSetting("tolerance")).is_none();
  if (isTolerant && !setting.hasEffectWithTolerance)
    refuse(setting, "has no effect with a tolerance, which decides how the field is built: leave out one of them");
}

std::string typeText(const BuildSetting& setting) {
  if (setting.type == Type::flag) return "bool";
  if (setting.type == Type::wholeNumber) return "int";
  if (setting.type == Type::wholeNumbers) return "int or three of them";
  if (setting.type == Type::number) return setting.mayBeShare ? "float or 'N%'" : "float";
  std::string words;
  for (const std::string_view word : setting.words) words += (words.empty() ? "'" : " | '") + std::string(word) + "'";
  return words;
}

}  // namespace

BuildOptions buildOptionsFrom(const py::kwargs& arguments, double longestSide) {
  requireKnownNames(arguments);
  BuildOptions options;
  if (isAnyGiven(arguments, {Ending::byDistance, Ending::otherQuantity, Ending::tolerance})) options.targetError = 0;
  for (const BuildSetting& setting : buildSettings()) {
    const py::object value = given(arguments, setting);
    if (!setting.isOffered || value.is_none()) continue;
    const std::vector<double> numbers = valueOf(setting, value, longestSide);
    const bool isOff = setting.type == Type::flag && numbers[0] == 0;
    if (isOff && setting.hasOwner != nullptr) continue;  // the flag is off, as it is without its owner
    requireCompanions(arguments, setting, options);
    setting.set(options, numbers);
  }
  return options;
}

std::string settingsHelp() {
  std::string text;
  for (const BuildSetting& setting : buildSettings()) {
    if (!setting.isOffered) continue;
    const std::string fallback = defaultText(setting);
    text += "\n" + pythonName(setting) + ": " + typeText(setting);
    if (!setting.unit.empty()) text += ", in " + std::string(setting.unit);
    if (!fallback.empty()) text += "; default " + fallback;
    text += "\n    " + std::string(setting.help) + "\n";
  }
  return text;
}

}  // namespace hpsdf::python
