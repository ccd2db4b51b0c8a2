#pragma once
// Evaluates a field at points, finds its range over boxes or the closest points of a mesh. Points and boxes are given
// as text, and so are the answers. They are processed in batches, so that millions of them need little memory.

#include <cstdint>
#include <functional>
#include <istream>
#include <string>
#include <string_view>

#include "hpsdf/exact_distance.h"
#include "hpsdf/field.h"

namespace hpsdf::app {

enum class PointFormat : std::uint8_t { csv, json };

/// Reads points from `in`, evaluates the field at them and passes the results to `write`. Returns the number of points.
/// If a line is not a point, throws `Error` with the message "name:line: …".
std::size_t queryPoints(const Field& field, std::istream& in, const std::string& name, PointFormat format,
                        const std::function<void(std::string_view)>& write);

/// Reads boxes, six numbers each, and passes certified ranges of the field to `write`, like `queryPoints`. The ranges
/// of the exact distance are there too if the field has bounds.
std::size_t queryBoxes(const Field& field, std::istream& in, const std::string& name, PointFormat format,
                       const std::function<void(std::string_view)>& write);

/// Reads points and passes the closest points of a mesh and its winding numbers to `write`, like `queryPoints`.
std::size_t queryClosestPoints(const ExactDistance& distance, std::istream& in, const std::string& name,
                               PointFormat format, const std::function<void(std::string_view)>& write);

}  // namespace hpsdf::app
