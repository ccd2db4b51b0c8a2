// Writes regular grids as image data of VTK.
#include <span>
#include <string>

#include "grids/vtk_file.h"
#include "hpsdf/output/grids.h"

namespace hpsdf {
namespace {

std::string textOf(const Vector3& v) { return grids::numbersText(std::span(v.data(), 3)); }

/// Returns the indices of the first and the last point along each axis.
std::string extentText(const GridLayout& layout) {
  std::string text;
  for (const std::uint32_t points : layout.points) text += (text.empty() ? "0 " : " 0 ") + std::to_string(points - 1);
  return text;
}

}  // namespace

void writeVti(const RegularGrid& grid, NumberType type, OutputFile& out, const Progress& progress) {
  const std::string extent = extentText(grid.layout);
  grids::VtkFile file("ImageData", grids::kVtkVersion, progress);
  file.open(
      "ImageData",
      {{"WholeExtent", extent}, {"Origin", textOf(grid.layout.origin)}, {"Spacing", textOf(grid.layout.spacing)}});
  file.open("Piece", {{"Extent", extent}});
  if (grid.gradients.empty())
    file.open("PointData", {{"Scalars", "distance"}});
  else
    file.open("PointData", {{"Scalars", "distance"}, {"Vectors", "gradient"}});
  file.array("distance", type, grid.values);
  if (!grid.gradients.empty())
    file.array("gradient", type, std::span(grid.gradients.front().data(), 3 * grid.gradients.size()), 3);
  file.write(out);
}

}  // namespace hpsdf
