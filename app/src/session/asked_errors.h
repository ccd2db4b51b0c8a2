#pragma once
// Compares the errors that were measured of a built field with those that were asked for.

#include <string>

#include "hpsdf/field.h"
#include "language/registry.h"

namespace hpsdf::app {

/// Returns what a built field misses of the errors that the arguments of its construction ask for, and what to do about
/// it, in one line. Returns "" if it misses nothing.
std::string missedErrors(const Arguments& arguments, const Field& field);

}  // namespace hpsdf::app
