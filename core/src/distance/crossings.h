#pragma once

#include <cstddef>

#include "distance/hierarchy.h"
#include "hpsdf/crossings.h"

namespace hpsdf::distance {

/// `hpsdf::findCrossings` of a hierarchy's triangles, by their indices in the mesh.
Crossings findCrossings(const Hierarchy& hierarchy, std::size_t limit);

}  // namespace hpsdf::distance
