#pragma once
// Summaries of meshes as text and as JSON.

#include <string>

#include "hpsdf/distance_function.h"
#include "hpsdf/mesh_report.h"
#include "text/json.h"

namespace hpsdf::app {

Json meshJson(const std::string& name, const MeshReport& report);

std::string meshText(const std::string& name, const MeshReport& report);

/// Lists faulty edges: "3 boundary, 1 non-manifold and 0 inconsistent edges".
std::string faultyEdges(const MeshReport& report);

std::string closednessText(const MeshReport& report);

/// The name of an inside test as `--sign` spells it; "unknown" for `automatic`.
std::string insideTestName(InsideTest sign);

/// The reason for the choice with a position, as in "the mesh meets itself, as at (0, 1, 2)". `mesh` is the mesh's
/// box.
std::string reasonText(const InsideTestChoice& choice, const Box& mesh);

}  // namespace hpsdf::app
