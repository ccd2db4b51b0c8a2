#pragma once
// Summaries of meshes as text and as JSON.

#include <string>

#include "hpsdf/distance_function.h"
#include "hpsdf/mesh_report.h"
#include "text/json.h"

namespace hpsdf::app {

Json meshJson(const std::string& name, const MeshReport& report);

std::string meshText(const std::string& name, const MeshReport& report);

/// Returns the numbers of faulty edges as text: "3 boundary, 1 non-manifold and 0 inconsistent edges".
std::string faultyEdges(const MeshReport& report);

std::string closednessText(const MeshReport& report);

/// Returns the name by which the option --sign selects an inside test (a method that tells inside from outside).
/// Returns "unknown" for `automatic`.
std::string insideTestName(InsideTest sign);

/// Returns the reason why an inside test was chosen, with a position if one is known: "the mesh meets itself, as at
/// (0, 1, 2)". `mesh` is the bounding box of the mesh.
std::string reasonText(const InsideTestChoice& choice, const Box& mesh);

}  // namespace hpsdf::app
