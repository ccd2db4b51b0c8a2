#pragma once
// Points in, distances and gradients out, as text; batch by batch, so that millions of points need little memory.

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <istream>
#include <string>
#include <string_view>

#include "hpsdf/field.h"

namespace hpsdf::app {

enum class PointFormat : std::uint8_t { csv, json };

/// Throws `Error` naming a file that is missing, a folder or unreadable.
std::ifstream openPoints(const std::filesystem::path& file);

/// Answers every point of `in`, called `name` in messages, through `write`; returns how many there were.
/// Throws `Error` "name:line: …" for a line that is not a point.
std::size_t queryPoints(const Field& field, std::istream& in, const std::string& name, PointFormat format,
                        const std::function<void(std::string_view)>& write);

}  // namespace hpsdf::app
