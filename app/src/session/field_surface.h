#pragma once
// The surface from which a field was made, for commands that compare the field with this surface.

#include <string>
#include <string_view>

#include "construction/reference_surface.h"
#include "language/registry.h"
#include "session/current_field.h"

namespace hpsdf::app {

/// Returns the parameter `mesh`, which all commands that compare a field with its surface have.
Parameter surfaceParameter();

/// Returns the mesh file or shape from which the current field was made. If the field was loaded from a file, looks for
/// a mesh of the stored name beside it and in the current folder. If the surface is unknown, throws `Error`;
/// the message then asks the user for the argument `asked`.
std::string surfaceOf(const CurrentField& current, const char* asked = "MESH");

/// Returns true if `surfaceOf` finds the surface.
bool findsSurface(const CurrentField& current);

/// Throws `Error` if the current field was not made from `surface`. `reference` holds the data of `surface`.
/// The error message ends with the text `otherwise`.
void refuseForeign(const CurrentField& current, const ReferenceSurface& reference, const std::string& surface,
                   std::string_view otherwise = "");

}  // namespace hpsdf::app
