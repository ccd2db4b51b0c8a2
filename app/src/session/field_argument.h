#pragma once
// The field that a command works on: one that it names, or the current one.

#include <string>

#include "language/registry.h"
#include "session/session.h"

namespace hpsdf::app {

/// The parameter `field` of commands that look at a field.
Parameter fieldParameter();

/// Loads a field's file as the current field. Throws `Error` naming the file.
void loadField(Session& session, const std::string& file);

/// Loads the field that the argument `field` names, or keeps the current one. Throws `Error` where there is neither.
void useField(Session& session, const Arguments& arguments);

}  // namespace hpsdf::app
