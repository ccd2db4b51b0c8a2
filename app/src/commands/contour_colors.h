#pragma once
// Colours of a contour's vertices: the parameters of `contour` for them, and what they yield.

#include <optional>
#include <string>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/point_colors.h"
#include "hpsdf/triangle_mesh.h"
#include "language/registry.h"
#include "session/session.h"
#include "text/json.h"

namespace hpsdf::app {

/// Returns the parameters that choose the colours of vertices. Those that pictures have too are taken from `render`,
/// which must be in the registry.
std::vector<Parameter> vertexColorParameters(const Registry& registry);

/// Throws `Error` if the arguments contradict each other, or if a file of this name cannot hold colours.
void checkVertexColors(const Arguments& arguments, const std::string& file);

/// Returns the data from which the colours are made, such as the exact distance; empty if the arguments ask for none.
/// Loads what it needs, so that a missing file is found before the long work.
render::ReferenceData vertexColorData(Session& session, const Arguments& arguments);

/// Returns the colours of the mesh's vertices, or std::nullopt if the arguments ask for none. `field` is the session's
/// current field or a blended copy of it, and `data` is what `vertexColorData` returned.
std::optional<render::PointColors> vertexColors(const Arguments& arguments, const Field& field,
                                                const TriangleMesh& mesh, const render::ReferenceData& data);

/// Returns what the colours mean: "error from 1e-6 to 1e-3", or "degree".
std::string vertexColorText(const Arguments& arguments, const render::PointColors& colors);
/// Returns the same as JSON; null without colours.
Json vertexColorJson(const Arguments& arguments, const std::optional<render::PointColors>& colors);

}  // namespace hpsdf::app
