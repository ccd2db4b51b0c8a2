#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>

#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/nearest_name.h"
#include "hpsdf/detail/text.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

/// Returns the number that the whole text is, apart from blanks around it.
std::optional<double> numberFrom(std::string_view text) {
  text = trimmed(text);
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Returns the numbers of a list with commas, or no number if one of them is not a number.
std::vector<double> numbersIn(std::string_view text) {
  std::vector<double> numbers;
  for (std::size_t first = 0; first <= text.size();) {
    const std::size_t comma = std::min(text.find(',', first), text.size());
    const auto number = numberFrom(text.substr(first, comma - first));
    if (!number) return {};
    numbers.push_back(*number);
    first = comma + 1;
  }
  return numbers;
}

bool isWholeKind(const BuildSetting& setting) {
  return setting.type == BuildSetting::Type::wholeNumber || setting.type == BuildSetting::Type::wholeNumbers;
}

std::size_t mostNumbers(const BuildSetting& setting) {
  return setting.type == BuildSetting::Type::wholeNumbers ? 3 : 1;
}

}  // namespace

std::vector<std::string> GivenSettings::names() const {
  std::vector<std::string> names;
  for (const BuildSetting& setting : buildSettings())
    if (setting.isOffered) names.push_back(spelled(setting.name));
  return names;
}

void GivenSettings::give(std::string_view name, std::string_view text) {
  const BuildSetting& setting = settingOf(name);
  values_[setting.name] = valueFrom(setting, text);
}

void GivenSettings::give(std::string_view name, std::span<const double> numbers) {
  const BuildSetting& setting = settingOf(name);
  values_[setting.name] = {.numbers = checked(setting, numbers)};
}

void GivenSettings::takeBack(std::string_view name) { values_.erase(settingOf(name).name); }

BuildOptions GivenSettings::options(double longestSide) const {
  using Ending = BuildSetting::Ending;
  BuildOptions options;
  if (isAnyGiven({Ending::byDistance, Ending::otherQuantity, Ending::tolerance})) options.targetError = 0;
  // A setting that needs another one comes after it in the table, so that `options` tells whether that one is on.
  for (const BuildSetting& setting : buildSettings()) {
    const auto found = values_.find(setting.name);
    if (found == values_.end()) continue;
    std::vector<double> numbers = found->second.numbers;
    const bool isOff = setting.type == BuildSetting::Type::flag && numbers[0] == 0;
    if (isOff && setting.hasOwner != nullptr) continue;  // the flag is off, as it is without its owner
    requireCompanions(setting, options);
    if (found->second.isShare) {
      if (!(longestSide > 0)) refuse(setting, "expected a length, because the longest side of the surface is unknown");
      numbers[0] *= longestSide;
    }
    setting.set(options, numbers);
  }
  return options;
}

const BuildSetting& GivenSettings::settingOf(std::string_view name) const {
  for (const BuildSetting& setting : buildSettings())
    if (setting.isOffered && spelled(setting.name) == name) return setting;
  throw Error(ErrorKind::option, shownText(name),
              "there is no such option: " +
                  didYouMean(name, names(), "'hpsdf help build' and docs/commands.md list all options"));
}

std::string GivenSettings::spelled(std::string_view name) const {
  std::string text(name);
  std::ranges::replace(text, '-', separator_);
  return text;
}

void GivenSettings::refuse(const BuildSetting& setting, const std::string& problem) const {
  throw Error(ErrorKind::option, spelled(setting.name), problem);
}

bool GivenSettings::isAnyGiven(std::initializer_list<BuildSetting::Ending> endings) const {
  return std::ranges::any_of(buildSettings(), [&](const BuildSetting& setting) {
    return values_.contains(setting.name) && std::ranges::find(endings, setting.ending) != endings.end();
  });
}

void GivenSettings::requireInRange(const BuildSetting& setting, double number) const {
  const bool isWhole = isWholeKind(setting);
  const bool aboveMinimum = setting.minimumExcluded ? number > setting.minimum : number >= setting.minimum;
  if (std::isfinite(number) && aboveMinimum && number <= setting.maximum && (!isWhole || number == std::floor(number)))
    return;
  std::ostringstream range;
  range << "expected a " << (isWhole ? "whole " : "") << "number";
  if (std::isfinite(setting.minimum)) range << (setting.minimumExcluded ? " above " : " from ") << setting.minimum;
  if (std::isfinite(setting.maximum)) range << " up to " << setting.maximum;
  range << ", got " << number;
  refuse(setting, range.str());
}

/// Throws `Error` if a setting cannot be given together with the others.
void GivenSettings::requireCompanions(const BuildSetting& setting, const BuildOptions& options) const {
  if (values_.contains(setting.exclusive))
    refuse(setting, "cannot be given together with " + spelled(setting.exclusive));
  if (setting.hasOwner != nullptr && !setting.hasOwner(options))
    refuse(setting, "has no effect without " + spelled(setting.owner));
  if (values_.contains("tolerance") && !setting.hasEffectWithTolerance)
    refuse(setting, "has no effect with a tolerance, which decides how the field is built: leave out one of them");
}

double GivenSettings::indexOfWord(const BuildSetting& setting, std::string_view word) const {
  const std::vector<std::string> words(setting.words.begin(), setting.words.end());
  const auto found = std::ranges::find(words, word);
  if (found != words.end()) return static_cast<double>(found - words.begin());
  std::string all;
  for (const std::string& each : words) all += (all.empty() ? "'" : ", '") + each + "'";
  refuse(setting, "there is no '" + shownText(word) + "': " + didYouMean(word, words, "expected one of " + all));
}

std::vector<double> GivenSettings::checked(const BuildSetting& setting, std::span<const double> numbers) const {
  if (setting.type == BuildSetting::Type::choice) refuse(setting, "expected a word");
  const std::size_t most = mostNumbers(setting);
  if (numbers.size() != 1 && numbers.size() != most)
    refuse(setting, most == 1 ? "expected one number" : "expected one number or three");
  for (const double number : numbers) requireInRange(setting, number);
  return {numbers.begin(), numbers.end()};
}

GivenSettings::Value GivenSettings::valueFrom(const BuildSetting& setting, std::string_view text) const {
  const std::string_view word = trimmed(text);
  if (setting.type == BuildSetting::Type::choice) return {.numbers = {indexOfWord(setting, word)}};
  if (setting.type == BuildSetting::Type::flag) {
    if (word != "true" && word != "false") refuse(setting, "expected 'true' or 'false', got '" + shownText(word) + "'");
    return {.numbers = {word == "true" ? 1.0 : 0.0}};
  }
  const bool isShare = setting.mayBeShare && word.ends_with('%');
  std::vector<double> numbers = numbersIn(isShare ? word.substr(0, word.size() - 1) : word);
  if (numbers.empty())
    refuse(setting, std::string("expected a number") +
                        (setting.mayBeShare ? " or a percentage of the mesh's longest side, such as '0.02%'" : "") +
                        ", got '" + shownText(word) + "'");
  if (isShare)
    for (double& number : numbers) number /= 100;
  return {.numbers = checked(setting, numbers), .isShare = isShare};
}

}  // namespace hpsdf
