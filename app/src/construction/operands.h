#pragma once
// Makes expressions of meshes, shapes and fields from text.

#include <string>

#include "console/console.h"
#include "hpsdf/combine/expression.h"
#include "hpsdf/exact_distance.h"

namespace hpsdf::app {

/// Returns the expression with its operands loaded: field files, mesh files and built-in shapes. Each file is read
/// once. If `proof` names a setting that proves errors, such as "certified", fields and open meshes are refused, of
/// which nothing is proven. Throws `Error` if a file cannot be loaded or a mesh does not fit into memory, naming the
/// column of its name, and `Cancelled` after Ctrl-C.
Expression withLoadedOperands(const Console& console, const Expression& expression, InsideTest insideTest,
                              const std::string& proof = "");

}  // namespace hpsdf::app
