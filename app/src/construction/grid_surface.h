#pragma once
// Surfaces that are given by the distances of a grid: files of OpenVDB (.vdb), VTK (.vti) and NumPy (.npy).

#include <optional>
#include <string>
#include <string_view>

#include "console/console.h"
#include "hpsdf/input/grid_distance.h"

namespace hpsdf::app {

/// Returns true for a name that ends as those of grids do.
bool isGridName(std::string_view surface);

/// Returns true for a grid whose file tells where its points lie: for all but arrays of NumPy.
bool tellsWherePointsLie(std::string_view grid);

/// Where the points of an array of NumPy lie, whose file does not tell it. What is not given is 0 or 1.
struct GridPlacement {
  std::optional<Vector3> origin;
  std::optional<Vector3> spacing;

  bool isGiven() const { return origin || spacing; }
};

/// Reads a grid as a distance, and reports its size and the likely error of its interpolation. Throws `Error` if the
/// file cannot be read, or if `placement` is given for a file that tells where its points lie.
GridDistance readGridSurface(const Console& console, const std::string& file, const GridPlacement& placement);

/// Reads a level set of OpenVDB. Throws `Error`, also if the program was built without OpenVDB.
GridDistance readLevelSet(const Console& console, const std::string& file);

}  // namespace hpsdf::app
