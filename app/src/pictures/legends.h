#pragma once
// Legends for HTML pages: the colours of legends as SVG.

#include <map>
#include <string>

#include "hpsdf/render/image.h"
#include "hpsdf/render/picture.h"

namespace hpsdf::app {

/// The colours of degrees or depths.
using LevelColors = std::map<int, render::Color>;
LevelColors levelColors(const render::Legend& legend);

/// Returns an SVG bar with one rectangle for each level (a degree or a depth), in the level's colour and as wide as its
/// share. A rectangle contains its degree or depth if there is room. Its tooltip shows the degree or depth and, if
/// `tellsShares` is true, the share.
std::string sharesSvg(int width, const std::map<int, double>& shares, const LevelColors& colors, bool tellsShares);

/// Returns an SVG legend of the colours of all levels (degrees or depths).
std::string levelsSvg(const LevelColors& colors);

/// Returns an SVG legend of a colour bar, from its low end at the left to its high end, with its marks below.
std::string barSvg(const render::Legend& legend);

}  // namespace hpsdf::app
