#pragma once
// The table of all settings with which a field can be built. The program's options, the settings in field files and the
// checks of ranges follow from this table. It also says which settings must be unchanged when a build resumes from a
// checkpoint file.

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/build_options.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf {

/// Headings of the groups of settings in help texts.
namespace setting_group {
constexpr std::string_view kAsked = "What you ask for", kResult = "What you get", kMethod = "How it is built";
}

/// A setting of `BuildOptions`. The value of a setting is a list of numbers: one number for a numeric setting;
/// 0 or 1 for a flag; the index of a word for a choice; three numbers, one for each axis, for the grid. The
/// list is empty if the setting is off or unset.
struct BuildSetting {
  enum class Type : std::uint8_t { number, wholeNumber, wholeNumbers, choice, flag };
  /// The event at which a setting ends the construction.
  enum class Ending : std::uint8_t {
    none,           ///< the setting does not end the construction
    target,         ///< the target error is reached
    byDistance,     ///< both errors of `NearFarError`, given instead of the target error, are reached
    tolerance,      ///< every cell is within a tolerance, given instead of the target error
    otherQuantity,  ///< a maximum error or a limit of bytes is reached; the target error then has no default
    steps,          ///< a number of steps is done, even if the target error is not reached
  };

  std::string_view name = {};  ///< as users write it: "max-depth"
  Type type = Type::number;
  std::string_view help = {};
  std::string_view group = {};  ///< heading above the setting in help texts
  std::string_view unit = {};
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  bool minimumExcluded = false;
  std::vector<std::string_view> words = {};  ///< the words from which users choose, for a choice
  std::vector<double> fallback = {};         ///< default of a setting that `BuildOptions` leaves unset
  Ending ending = Ending::none;
  std::string_view exclusive = {};  ///< name of a setting that cannot be given together with this one
  std::string_view owner = {};      ///< the option without which this setting has no effect, such as "continuity weak"
  bool (*hasOwner)(const BuildOptions&) = nullptr;
  int storedAt = 0;                     ///< position among the settings in a field's file; 0: not stored
  bool decides = true;                  ///< the finished field depends on the value of this setting
  bool mayBeShare = false;              ///< users may give the value as a percentage of the mesh's longest side
  bool hasEffectWithTolerance = false;  ///< the setting has an effect on a construction with a tolerance
  bool isOffered = true;                ///< the command-line program has an option for this setting
  bool isAdvanced = false;              ///< only the complete help texts show this setting
  bool isChecked = false;     ///< `checkBuild` checks the range, because C++ code could set a value out of range
  std::string_view key = {};  ///< name in JSON if it differs from `name` with underscores
  std::vector<double> (*get)(const BuildOptions&) = nullptr;
  void (*set)(BuildOptions&, std::span<const double>) = nullptr;
};

/// Returns all settings in the order in which users see them. A setting that has an effect only with another
/// setting comes after that setting.
std::span<const BuildSetting> buildSettings();

/// Returns the setting of this name. Throws std::logic_error if there is no such setting.
const BuildSetting& buildSetting(std::string_view name);

/// Returns the value that a setting has in `options`, as users write it: "4", "6,6,6", "hp", "true". Returns an
/// empty string if the setting is off or unset.
std::string settingText(const BuildSetting& setting, const BuildOptions& options);

/// Returns the default value of a setting, as users write it.
std::string defaultText(const BuildSetting& setting);

/// The values that a user of a binding gives to settings by name, each checked when it is given.
class GivenSettings {
 public:
  /// `separator` stands between the words of a setting's name: '-' as in "max-depth" or, in Python, '_'.
  explicit GivenSettings(char separator = '-') : separator_(separator) {}

  /// Returns the names of all settings that users can give.
  std::vector<std::string> names() const;

  /// Gives a setting a value as users write it: "1e-6", "6,6,6", "hp" or "true", as `settingText` returns it, or a
  /// percentage of the mesh's longest side ("0.02%") where the setting allows it. Throws `Error` of the kind `option`,
  /// whose subject is the name, if there is no such setting, or if the text is no value of it.
  void give(std::string_view name, std::string_view text);

  /// Gives a setting that is no choice a value as numbers, as `BuildSetting` describes them. Throws as the other
  /// function does.
  void give(std::string_view name, std::span<const double> numbers);

  /// Takes back what was given to a setting, if anything was. Throws `Error` if there is no such setting.
  void takeBack(std::string_view name);

  /// Returns the options of a construction with these settings. The target error has no default where another end of
  /// the construction is given. Percentages refer to `longestSide`, the longest side of the mesh in its units, or 0 if
  /// that is unknown. Throws `Error` of the kind `option` for settings that exclude each other or have no effect, and
  /// for a percentage without a longest side.
  BuildOptions options(double longestSide) const;

 private:
  struct Value {
    std::vector<double> numbers;
    bool isShare = false;  ///< the only number is a multiple of the mesh's longest side
  };

  const BuildSetting& settingOf(std::string_view name) const;
  std::string spelled(std::string_view name) const;
  [[noreturn]] void refuse(const BuildSetting& setting, const std::string& problem) const;
  bool isAnyGiven(std::initializer_list<BuildSetting::Ending> endings) const;
  void requireInRange(const BuildSetting& setting, double number) const;
  void requireCompanions(const BuildSetting& setting, const BuildOptions& options) const;
  double indexOfWord(const BuildSetting& setting, std::string_view word) const;
  std::vector<double> checked(const BuildSetting& setting, std::span<const double> numbers) const;
  Value valueFrom(const BuildSetting& setting, std::string_view text) const;

  char separator_;
  std::map<std::string_view, Value> values_;  // by the names in `buildSettings`
};

/// Returns a copy of `options` in which every setting that field files do not store has its value from a default
/// `FieldMetadata`.
BuildOptions storedSettings(const BuildOptions& options);

/// Returns options with which `build` makes a field like `field`. These options combine the settings in the field's
/// metadata with settings that follow from the field's arrays, such as the base grid.
BuildOptions settingsOf(const FieldData& field);

}  // namespace hpsdf
