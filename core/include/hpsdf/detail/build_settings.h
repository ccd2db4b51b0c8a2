#pragma once
// The table of all settings of a construction: the program's options, the settings stored with a field, the identity of
// a checkpoint and the checks of ranges all come from it.

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/build_options.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf {

/// Headings above settings in help texts.
namespace setting_group {
constexpr std::string_view kAsked = "What you ask for", kResult = "What you get", kMethod = "How it is built";
}

/// One setting of `BuildOptions`. Its value is a list of numbers: one for a number; 0 or 1 for a flag; the index of a
/// word for a choice; one for each axis of the grid; none where the setting asks for nothing.
struct BuildSetting {
  enum class Type : std::uint8_t { number, wholeNumber, wholeNumbers, choice, flag };
  /// The way in which a setting ends the construction.
  enum class Ending : std::uint8_t {
    none,           ///< it does not
    target,         ///< by the target error
    byDistance,     ///< by errors by distance, in place of the target error
    otherQuantity,  ///< by the maximum error or the bytes; then the target error has no default
    steps,          ///< early, whatever the target
  };

  std::string_view name = {};  ///< as users write it: "max-depth"
  Type type = Type::number;
  std::string_view help = {};
  std::string_view group = {};  ///< heading above it in help texts
  std::string_view unit = {};
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  bool minimumExcluded = false;
  std::vector<std::string_view> words = {};  ///< of a choice
  std::vector<double> fallback = {};         ///< default of a setting that `BuildOptions` leaves unset
  Ending ending = Ending::none;
  std::string_view exclusive = {};  ///< the setting that it takes the place of, which must not be given too
  std::string_view owner = {};      ///< the setting, with its word, without which it has no effect: "continuity weak"
  bool (*hasOwner)(const BuildOptions&) = nullptr;
  int storedAt = 0;           ///< its position among the settings in a field's file; 0: it is not stored
  bool decides = true;        ///< the field depends on it
  bool isOffered = true;      ///< the program has an option for it
  bool isAdvanced = false;    ///< help texts show it only where all options are asked for
  bool isChecked = false;     ///< values out of range can be given in C++ and are refused
  std::string_view key = {};  ///< its name in JSON where that is not `name` with underscores
  std::vector<double> (*get)(const BuildOptions&) = nullptr;
  void (*set)(BuildOptions&, std::span<const double>) = nullptr;
};

/// All settings in the order in which users read them; a setting follows its owner.
std::span<const BuildSetting> buildSettings();

/// Throws std::logic_error for a name that the table does not have.
const BuildSetting& buildSetting(std::string_view name);

/// A setting's value as users write it: "4", "6,6,6", "hp", "true"; empty where it asks for nothing.
std::string settingText(const BuildSetting& setting, const BuildOptions& options);

/// The value that holds where users give none.
std::string defaultText(const BuildSetting& setting);

/// The settings that a field keeps, all others as in a field that was not built.
BuildOptions storedSettings(const BuildOptions& options);

/// The settings with which a field like this one is built again: those it keeps, and those that its arrays show.
BuildOptions settingsOf(const FieldData& field);

}  // namespace hpsdf
