#pragma once
// The surface that a field was made from.

#include <string>
#include <string_view>

#include "construction/building.h"
#include "language/registry.h"
#include "session/current_field.h"

namespace hpsdf::app {

/// The surface that a field was made from; throws `Error` where it does not say.
std::string surfaceOf(const CurrentField& current, const char* asked = "MESH");

/// The surface that the argument `mesh` names, or the one that the current field itself names; throws `Error` where
/// neither does.
std::string surfaceFor(const CurrentField& current, const Arguments& arguments);

/// Throws `Error` where the current field was made from another surface than this one, `surface`; `otherwise` ends the
/// message.
void refuseForeign(const CurrentField& current, const ReferenceSurface& reference, const std::string& surface,
                   std::string_view otherwise = "");

}  // namespace hpsdf::app
