#pragma once
// The argument FIELD, by which a command names the field on which it works.

#include <string>

#include "language/registry.h"
#include "session/session.h"

namespace hpsdf::app {

/// Returns the parameter `field` of commands that read a field.
Parameter fieldParameter();

/// Loads a file as the current field. Throws `Error` naming the file.
void loadField(Session& session, const std::string& file);

/// Loads the field that the argument `field` names, or keeps the current one. Throws `Error` where neither exists.
void useField(Session& session, const Arguments& arguments);

}  // namespace hpsdf::app
