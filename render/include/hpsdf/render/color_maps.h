#pragma once
// The colours that stand for levels and for numbers: a fixed palette of levels, and named colour maps.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hpsdf/render/image.h"

namespace hpsdf::render {

/// Each level, a polynomial degree or an octree depth, has one colour in all pictures. The colours of the levels below
/// this one, of exact leaves, of cracks and of the paper differ by at least 20 (CIEDE2000) from each other, also for
/// readers with protanopia, deuteranopia or tritanopia, and their lightness falls with the level. The colours of higher
/// levels are greens that darken with the level; they are closer to each other and to those of the others.
constexpr int kDistinctLevels = 6;

/// Returns the colour of a level, 0 to 30, or of exact leaves (`kExactDegree`). Any other number
/// gets magenta, which the palette does not contain, so that a fault in the buffers becomes visible.
Color levelColor(int level);

enum class MapKind : std::uint8_t {
  ordered,    ///< for quantities: lightness rises from 0 to 1
  diverging,  ///< for signed distances: white at 0.5, darker towards 0 (inside) and 1 (outside)
};

/// A named map from the numbers 0 to 1 to colours.
struct ColorMap {
  std::string name;  ///< the map's name in commands, such as "violet-yellow"
  MapKind kind;
  std::string explanation;      ///< what it is good for, in a few words
  LinearColor (*at)(double t);  ///< numbers beyond 0 and 1 get the colours of the ends
};

/// Returns all colour maps. The first one of each kind is the default.
std::span<const ColorMap> colorMaps();

/// Returns the map of this kind and name, or the default one for the name "". Throws `Error`, which names the maps of
/// the kind, if there is none.
const ColorMap& colorMap(MapKind kind, const std::string& name);

/// Returns `count` colours of the map at even steps, from 0 to 1; at least 2.
std::vector<Color> colorsOf(const ColorMap& map, int count);

}  // namespace hpsdf::render
