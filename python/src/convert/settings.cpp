#include "convert/settings.h"

#include <algorithm>
#include <string>
#include <vector>

#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/nearest_name.h"

namespace py = pybind11;

namespace hpsdf::python {
namespace {

using Type = BuildSetting::Type;

std::string pythonName(const BuildSetting& setting) {
  std::string name(setting.name);
  std::ranges::replace(name, '-', '_');
  return name;
}

/// Returns a text of the table with the names of settings as Python writes them.
std::string inPython(std::string text) {
  for (const BuildSetting& setting : buildSettings()) {
    const std::string name = pythonName(setting);
    for (std::size_t at = text.find(setting.name); name != setting.name && at != std::string::npos;
         at = text.find(setting.name, at + name.size()))
      text.replace(at, name.size(), name);
  }
  return text;
}

void requireKnownNames(const py::kwargs& arguments, const std::vector<std::string>& known) {
  for (const auto& [key, value] : arguments) {
    const auto name = key.cast<std::string>();
    if (std::ranges::find(known, name) == known.end())
      throw py::type_error("build() has no option '" + name +
                           "': " + didYouMean(name, known, "help(hpsdf.build) lists all options"));
  }
}

double numberOf(const std::string& name, const py::handle& value) {
  const double number = PyFloat_AsDouble(value.ptr());
  if (number == -1 && PyErr_Occurred() != nullptr) {
    PyErr_Clear();
    throw py::type_error(name + ": expected a number");
  }
  return number;
}

/// Returns the numbers that stand for a value that is no text.
std::vector<double> valueOf(const BuildSetting& setting, const std::string& name, const py::handle& value) {
  if (setting.type == Type::choice) throw py::type_error(name + ": expected a string");
  if (setting.type == Type::flag) {
    py::detail::make_caster<bool> flag;  // takes NumPy's bool too
    if (!flag.load(value, false)) throw py::type_error(name + ": expected True or False");
    return {static_cast<bool>(flag) ? 1.0 : 0.0};
  }
  if (setting.type != Type::wholeNumbers || !py::isinstance<py::sequence>(value)) return {numberOf(name, value)};
  std::vector<double> numbers;
  for (const py::handle& item : value) numbers.push_back(numberOf(name, item));
  return numbers;
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
  GivenSettings given('_');
  requireKnownNames(arguments, given.names());
  for (const BuildSetting& setting : buildSettings()) {
    const std::string name = pythonName(setting);
    if (!arguments.contains(name)) continue;
    const py::object value = arguments[name.c_str()];
    if (value.is_none()) continue;
    if (py::isinstance<py::str>(value) && setting.type != Type::flag)
      given.give(name, value.cast<std::string>());
    else
      given.give(name, valueOf(setting, name, value));
  }
  return given.options(longestSide);
}

std::string settingsHelp() {
  std::string text;
  for (const BuildSetting& setting : buildSettings()) {
    if (!setting.isOffered) continue;
    const std::string fallback = defaultText(setting);
    text += "\n" + pythonName(setting) + ": " + typeText(setting);
    if (!setting.unit.empty()) text += ", in " + std::string(setting.unit);
    if (!fallback.empty()) text += "; default " + fallback;
    text += "\n    " + inPython(std::string(setting.help)) + "\n";
  }
  return text;
}

}  // namespace hpsdf::python
