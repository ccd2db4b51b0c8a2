#pragma once
// The colours, strengths and widths of the lines in slices.

#include "hpsdf/render/image.h"

namespace hpsdf::render {

constexpr Color kOutline = {18, 16, 38};  // outlines of cells
constexpr Color kIsoLine = {24, 28, 44};
constexpr Color kZeroLine = {10, 10, 20};
constexpr Color kSurfaceLine = {255, 255, 255};
constexpr Color kLineCasing = {16, 14, 34};

// The share, 0 to 1, of a line's colour where the line covers the ground.
constexpr double kOutlineStrength = 0.62;
constexpr double kIsoStrength = 0.42;
constexpr double kLineCasingStrength = 0.8;

// The widths of lines are in multiples of a thin line's width.
constexpr double kZeroWidth = 2.4;
constexpr double kSurfaceWidth = 1.6;
constexpr double kCasingWidth = 3.4;
// Cell outlines fade if the cell is narrower than this many widths of a thin line, because they would cover the colours
// of small cells.
constexpr double kOutlineFadesBelow = 10;
constexpr double kOutlineGoneBelow = 3;

}  // namespace hpsdf::render
