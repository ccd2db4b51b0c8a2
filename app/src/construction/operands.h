#pragma once
// Makes expressions of meshes, shapes and fields from text.

#include <string>
#include <vector>

#include "console/console.h"
#include "hpsdf/combine/expression.h"
#include "hpsdf/exact_distance.h"

namespace hpsdf::app {

/// Returns the expression with its operands loaded: field files, mesh files, grids (.vdb, .vti) and built-in shapes.
/// Each file is read once. If `proof` names a setting that proves errors, such as "certified", fields, grids and open
/// meshes are refused, of which nothing is proven. Throws `Error` if a file cannot be loaded or a mesh does not fit
/// into memory, naming the column of its name, and `Cancelled` after Ctrl-C.
Expression withLoadedOperands(const Console& console, const Expression& expression, InsideTest insideTest,
                              const std::string& proof = "");

/// Returns the operands of the Boolean operations in an expression, each with its own moves, rotations, scales, offsets
/// and shells, and moved, rotated and scaled as the result of its operation is. An offset or a shell of such a result
/// is left out, because it is none of a single operand. An expression without Boolean operations has one operand,
/// without its offsets and shells.
std::vector<Expression> booleanOperands(const Expression& expression);

}  // namespace hpsdf::app
