#pragma once
// The argument FIELD, with which a command names the field that it works on.

#include <string>

#include "language/registry.h"
#include "session/session.h"

namespace hpsdf::app {

/// Returns the parameter `field`, which all commands that read a field have.
Parameter fieldParameter();

/// Loads a field file and makes its field the current one. Throws `Error` naming the file.
void loadField(Session& session, const std::string& file);

/// Loads the field that the argument `field` names. Without this argument, keeps the current field. Throws
/// `Error` if there is neither the argument nor a current field.
void useField(Session& session, const Arguments& arguments);

/// Loads the field that the argument `field` names, and returns the surface that the argument `mesh` names. Without
/// `field`, keeps the current field; without `mesh`, returns the result of `surfaceOf`. If the session has a field, a
/// positional word alone may name the surface instead of the field. Throws `Error` if the arguments name something
/// else.
std::string useFieldWithSurface(Session& session, const Arguments& arguments);

}  // namespace hpsdf::app
