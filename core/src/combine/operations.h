#pragma once
// What the parser of expressions and their text share.

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "hpsdf/combine/expression.h"
#include "hpsdf/error.h"

namespace hpsdf::combine {

constexpr double kLeastFactor = 1e-12;  ///< of a scale; its reciprocal is the greatest factor

/// The words for `ShellSide`, in the order of its values.
constexpr std::array<std::string_view, 3> kSideNames = {"inward", "centred", "outward"};

const OperationDescription& descriptionOf(Operation operation);

/// Returns true for the name of a built-in shape.
bool isShapeName(std::string_view name);

/// Returns true if an expression can hold this name without quotes.
bool readsAsName(std::string_view name);

/// Returns the error about a column of an expression.
Error expressionError(ErrorKind kind, std::size_t column, const std::string& problem);

}  // namespace hpsdf::combine
