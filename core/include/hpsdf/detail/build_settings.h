#pragma once
// The table of all settings of a construction. The program's options, the settings stored with a field, the
// identity of a checkpoint and the checks of ranges are derived from this table.

#include <cstdint>
#include <limits>
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
  /// The way in which a setting ends the construction.
  enum class Ending : std::uint8_t {
    none,           ///< not at all
    target,         ///< when the target error is reached
    byDistance,     ///< when the errors by distance are reached, which replace the target error
    otherQuantity,  ///< at a maximum error or a limit of bytes; the target error then has no default
    steps,          ///< after a number of steps, whatever the target
  };

  std::string_view name = {};  ///< as users write it: "max-depth"
  Type type = Type::number;
  std::string_view help = {};
  std::string_view group = {};  ///< heading above it in help texts
  std::string_view unit = {};
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  bool minimumExcluded = false;
  std::vector<std::string_view> words = {};  ///< the words of a choice
  std::vector<double> fallback = {};         ///< default of a setting that `BuildOptions` leaves unset
  Ending ending = Ending::none;
  std::string_view exclusive = {};  ///< a setting that this one replaces, so that both cannot be given
  std::string_view owner = {};      ///< the setting, with its word, without which it has no effect: "continuity weak"
  bool (*hasOwner)(const BuildOptions&) = nullptr;
  int storedAt = 0;           ///< position among the settings in a field's file; 0: not stored
  bool decides = true;        ///< the field depends on it
  bool isOffered = true;      ///< the program has an option for it
  bool isAdvanced = false;    ///< help texts show it only where all options are asked for
  bool isChecked = false;     ///< `checkBuild` refuses values out of range, which C++ code could set
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

/// Returns the value, as users write it, that a setting has if users do not give it.
std::string defaultText(const BuildSetting& setting);

/// Returns `options` with the settings that files do not store reset. These settings get the values that they
/// have in the metadata of a field that `build` did not make.
BuildOptions storedSettings(const BuildOptions& options);

/// Returns options with which `build` makes a field like `field`. They combine the settings that the field
/// stores with settings that follow from its arrays.
BuildOptions settingsOf(const FieldData& field);

}  // namespace hpsdf
