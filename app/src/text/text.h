#pragma once
// Numbers, names and points as people read them.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "hpsdf/types.h"

namespace hpsdf::app {

/// 1234567 → "1,234,567"
std::string grouped(std::uint64_t number);

/// "1 face", "1,234 faces"
std::string countOf(std::size_t count, std::string_view one, std::string_view many);

/// Three digits, and a short exponent where it saves zeros: 1e-6, 3.06e-4, 0.125
std::string shortNumber(double number);

/// "(0.1, 0.2, 0.3)"
std::string vectorText(const Vector3& v);

/// With as many digits more as a place in a box far from the origin needs.
std::string vectorText(const Vector3& v, const Box& box);

/// "(0, 0, 0) to (1, 2, 3)", with as many digits more as it lies farther from the origin than it is long.
std::string boxText(const Box& box);

/// ".png" of a.PNG
std::string lowerExtension(const std::filesystem::path& file);

/// "bunny" of bunny.obj, "torus" of builtin:torus,major=0.7: plain characters only, for commands and file names.
std::string plainName(const std::string& source);

/// A word of a command as a shell takes it, quoted where it must be.
std::string shellWord(const std::string& word);

/// An indented line of a summary.
std::string summaryRow(std::string_view label, const std::string& value);

}  // namespace hpsdf::app
