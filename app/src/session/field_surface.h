#pragma once
// The surface from which a field was made, for commands that compare the two.

#include <string>
#include <string_view>

#include "construction/reference_surface.h"
#include "language/registry.h"
#include "session/current_field.h"

namespace hpsdf::app {

/// Returns the parameter `mesh` of commands that compare a field with its surface.
Parameter surfaceParameter();

/// Returns the mesh file or shape from which a field was made. Throws `Error` where that is unknown; the message
/// then asks for the argument `asked`.
std::string surfaceOf(const CurrentField& current, const char* asked = "MESH");

/// Returns the surface that the argument `mesh` names, else that of `surfaceOf`.
std::string surfaceFor(const CurrentField& current, const Arguments& arguments);

/// Throws `Error` where the current field was made from another surface than `surface`, whose data is `reference`. The
/// message ends with `otherwise`.
void refuseForeign(const CurrentField& current, const ReferenceSurface& reference, const std::string& surface,
                   std::string_view otherwise = "");

}  // namespace hpsdf::app
