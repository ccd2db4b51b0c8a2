#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "contour/edits/edited_mesh.h"

namespace hpsdf::contouring {

/// Returns the triangle on the other side of a triangle's side, or std::nullopt if there is none or more than one. Side
/// k is that between corners k and k + 1.
std::optional<std::uint32_t> neighborOf(const EditedMesh& mesh, std::uint32_t triangle, std::size_t side);

/// Returns the replacement of a triangle's side by the other diagonal of the quadrilateral of both triangles at it, or
/// std::nullopt if the mesh has an edge there already, or not two triangles at the side.
std::optional<Edit> flipOf(const EditedMesh& mesh, std::uint32_t triangle, std::size_t side);

}  // namespace hpsdf::contouring
