#pragma once
// Makes expressions of meshes, shapes and fields from text.

#include <string>

#include "console/console.h"
#include "hpsdf/combine/expression.h"
#include "hpsdf/exact_distance.h"

namespace hpsdf::app {

/// Returns the expression with its operands loaded: field files, mesh files and built-in shapes. Each file is read
/// once. Throws `Error` if a file cannot be loaded or a mesh does not fit into memory, naming the column of its name,
/// and `Cancelled` after Ctrl-C.
Expression withLoadedOperands(const Console& console, const Expression& expression, InsideTest insideTest);

/// Returns true if the loaded expression has a field among its operands.
bool hasField(const Expression& expression);

}  // namespace hpsdf::app
