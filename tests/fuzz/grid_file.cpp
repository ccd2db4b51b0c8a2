// Fuzz target: a grid file of the format HPSDF_GRID_FORMAT is refused, or gives as many values as points. A distance of
// the grid is refused, or has finite values in its box.
#include <cmath>
#include <vector>

#include "hpsdf/input/grid_distance.h"
#include "target.h"

namespace {

using namespace hpsdf;

void requireFiniteValues(const GridDistance& distance, const GridLayout& layout) {
  const Box box = layout.box();
  const std::vector<Vector3> points = {box.min(), box.center(), box.max(), box.center() + 0.3 * box.sizes()};
  std::vector<double> values(points.size());
  std::vector<Vector3> gradients(points.size());
  distance.withGradients(points, values, gradients);
  for (const double value : values) fuzz::require(!std::isnan(value), "distances are numbers");
  fuzz::require(!distance.source().box.isEmpty(), "there is a surface");
  distance.interpolationError();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::reads([&] {
    const RegularGrid grid = loadGrid(fuzz::fileOf("grid" HPSDF_GRID_FORMAT, fuzz::textOf(data, size)));
    fuzz::require(grid.values.size() == grid.layout.count() && grid.gradients.empty(), "each point has a value");
    fuzz::reads([&] { requireFiniteValues(GridDistance(grid), grid.layout); });
  });
  return 0;
}
