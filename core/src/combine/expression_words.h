#pragma once
// The words of expressions as text, which the parser and the writer of expressions share.

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "hpsdf/error.h"

namespace hpsdf::combine {

/// The words for `ShellSide`, in the order of its values.
constexpr std::array<std::string_view, 3> kSideNames = {"inward", "centred", "outward"};

bool isBlank(char c);
bool isQuote(char c);

/// Returns true for the name of a built-in shape.
bool isShapeName(std::string_view name);

/// Returns true if a word is meant as a number. It may still be none, or too great.
bool looksLikeNumber(std::string_view word);

/// Returns the number of bytes of the bare word at the beginning of `text`. The parameters of a shape belong to its
/// word.
std::size_t wordLength(std::string_view text);

/// Returns true if an expression can hold this name without quotes.
bool readsAsName(std::string_view name);

/// Returns the error about a column of an expression.
Error expressionError(ErrorKind kind, std::size_t column, const std::string& problem);

}  // namespace hpsdf::combine
