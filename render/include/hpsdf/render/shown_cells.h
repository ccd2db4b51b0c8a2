#pragma once

#include <cstdint>
#include <vector>

namespace hpsdf::render {

/// The style in which the octree's leaves are drawn in the picture of a surface.
enum class CellStyle : std::uint8_t {
  none,
  lines,  ///< the edges of the cells; edges fade where their cells are small in the picture
  boxes,  ///< solid boxes with 0.8 times the edge lengths of the cells
};

/// The leaves of the octree that a picture shows, and how it draws them.
struct ShownCells {
  CellStyle style = CellStyle::none;
  std::vector<int> degrees = {};  ///< degrees of the leaves to show, ascending; empty for all degrees
  std::vector<int> depths = {};   ///< depths of the leaves to show, ascending; empty for all depths
  bool atSurface = false;         ///< shows only leaves that the picture's surface crosses
};

}  // namespace hpsdf::render
