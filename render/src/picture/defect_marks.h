#pragma once
// Marks of a mesh's defects, painted over a finished view.

#include <array>
#include <string>
#include <vector>

#include "hpsdf/mesh_report.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/picture_settings.h"
#include "hpsdf/render/view.h"
#include "picture/legend.h"

namespace hpsdf::render {

/// Titles of the legend of a mesh's defects, from the longest to the shortest.
inline const std::array<std::string, 2> kDefectTitles = {"Defects of the mesh", "Defects"};

/// The colour of a kind of defects, for its marks. Faces that cross others have the colour of `DefectKind::crossing`.
Color defectColor(DefectKind kind);

/// The colour of faces that are seen from behind. Faces seen from outside have the colour of surfaces.
constexpr Color kBackColor = {120, 153, 158};

/// The kinds of defects that the mesh has, with the number of defects of each kind.
std::vector<Legend::Defects> defectLegend(const MeshDefects& defects);
/// The rows of the legend for the kinds of defects that the mesh has.
std::vector<Swatch> defectSwatches(const MeshDefects& defects);

/// Paints defective edges as lines and pinched vertices as dots. Small groups of defects, which would be
/// overlooked, get rings. A mark is dashed where something in the buffers hides it. The view lies in the upper
/// left corner of the picture.
void paintDefects(Image& picture, const Camera& camera, const ViewBuffers& buffers, int samples,
                  const MeshDefects& defects, double lineWidth);

}  // namespace hpsdf::render
