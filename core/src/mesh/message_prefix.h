#pragma once
// Private to core: how its messages name a mesh.

#include <string>

namespace hpsdf {

/// "NAME: " before a message, or "mesh: " for a mesh without a name.
inline std::string messagePrefix(const std::string& name) { return (name.empty() ? "mesh" : name) + ": "; }

}  // namespace hpsdf
