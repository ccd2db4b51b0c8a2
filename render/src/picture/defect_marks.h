#pragma once
// Where a mesh has defects, over a finished view.

#include <array>
#include <string>
#include <vector>

#include "hpsdf/mesh_report.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/picture.h"
#include "hpsdf/render/view.h"
#include "picture/legend.h"

namespace hpsdf::render {

/// Of a panel; the first that fits is taken.
inline const std::array<std::string, 2> kDefectTitles = {"Defects of the mesh", "Defects"};

/// Kinds are told apart on clay.
Color defectColor(DefectKind kind);

/// Those that there are.
std::vector<Legend::Defects> defectLegend(const MeshDefects& defects);
/// The same for a panel beside the view.
std::vector<Swatch> defectSwatches(const MeshDefects& defects);

/// Edges as lines, pinched vertices as dots; rings around what would be overlooked, being small or alone. Dashed where
/// something in the buffers hides it. The view lies in the picture's upper left corner.
void paintDefects(Image& picture, const Camera& camera, const ViewBuffers& buffers, int samples,
                  const MeshDefects& defects, double lineWidth);

}  // namespace hpsdf::render
