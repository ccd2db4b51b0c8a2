#include "construction/grid_surface.h"

#include <fmt/format.h>

#include <filesystem>

#include "hpsdf/detail/text.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

bool isLevelSetName(std::string_view file) { return lowerExtension(file) == ".vdb"; }
bool isNumPyName(std::string_view file) { return lowerExtension(file) == ".npy"; }

GridDistance readRegularGrid(const Console& console, const std::string& file, const GridPlacement& placement) {
  RegularGrid grid = loadGrid(file);
  if (placement.origin) grid.layout.origin = *placement.origin;
  if (placement.spacing) grid.layout.spacing = *placement.spacing;
  if (isNumPyName(file) && !placement.spacing)
    note(console, fmt::format("{}: the array does not tell the distance of its points, which is taken as 1; --spacing "
                              "gives another one",
                              file));
  return GridDistance(grid, {.name = std::filesystem::path(file).filename().string()});
}

}  // namespace

bool isGridName(std::string_view surface) { return isLevelSetName(surface) || isRegularGridName(surface); }

bool tellsWherePointsLie(std::string_view grid) { return !isNumPyName(grid); }

GridDistance readGridSurface(const Console& console, const std::string& file, const GridPlacement& placement) {
  if (placement.isGiven() && !isNumPyName(file))
    throw Error("spacing and origin belong to an array of NumPy (.npy): leave them out");
  GridDistance distance =
      isLevelSetName(file) ? readLevelSet(console, file) : readRegularGrid(console, file, placement);
  const InterpolationError error = distance.interpolationError();
  if (error.samples == 0) {
    note(console,
         fmt::format("{}: tricubic between samples; too few of them are within three spacings of the surface to "
                     "estimate the error of that. Are its distances in the unit of its spacing?",
                     file));
    return distance;
  }
  note(console,
       fmt::format("{}: tricubic between samples; leaving samples out suggests an error of RMS {}, greatest {}, "
                   "near the surface",
                   file, shortNumber(error.rms), shortNumber(error.max)));
  return distance;
}

}  // namespace hpsdf::app
