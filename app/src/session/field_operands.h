#pragma once
// The solids that were combined into a field, for slices that show their outlines.

#include <string>
#include <string_view>
#include <vector>

#include "console/console.h"
#include "hpsdf/render/picture_settings.h"
#include "session/current_field.h"

namespace hpsdf::app {

/// The word for the expression from which `combine` built the field.
constexpr std::string_view kOwnOperands = "own";

/// Loads the operands of an expression, in the units of the current field. The files of `kOwnOperands` are looked
/// for beside the field's file and in the current folder.
/// Throws `Error` for a field that `combine` did not build, for mistakes in the expression, for files that cannot be
/// read, and for files of `kOwnOperands` with other contents than when the field was built, and `Cancelled` after
/// Ctrl-C.
std::vector<render::OutlinedSolid> loadedOperands(const Console& console, const CurrentField& current,
                                                  const std::string& expression);

/// Throws `Error` if the text is neither "own" nor an expression. It opens no files.
void checkOperands(const std::string& expression);

}  // namespace hpsdf::app
