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

/// Titles of the panel, the longest first.
inline const std::array<std::string, 2> kDefectTitles = {"Defects of the mesh", "Defects"};

/// The colours of the kinds are distinguishable on clay.
Color defectColor(DefectKind kind);

/// The kinds of defects that the mesh has, with their numbers.
std::vector<Legend::Defects> defectLegend(const MeshDefects& defects);
/// The rows of the panel about the kinds of defects that the mesh has.
std::vector<Swatch> defectSwatches(const MeshDefects& defects);

/// Paints edges as lines and pinched vertices as dots, with rings around small groups, which would be overlooked. Marks
/// are dashed where something in the buffers hides them. The view lies in the picture's upper left corner.
void paintDefects(Image& picture, const Camera& camera, const ViewBuffers& buffers, int samples,
                  const MeshDefects& defects, double lineWidth);

}  // namespace hpsdf::render
