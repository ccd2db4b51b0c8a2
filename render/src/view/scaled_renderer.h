#pragma once
// Rendering of fields with very large or very small domains. Devices compute in float, in which the square of a
// length overflows for lengths above 1e19 and vanishes below 1e-19.

#include <functional>
#include <memory>

#include "hpsdf/render/renderer.h"

namespace hpsdf::render {

using MakeRenderer = std::function<std::unique_ptr<Renderer>(const Field&)>;

/// Makes a renderer for a field of any size. Calls `make` with the field itself if the size of its domain lies within
/// 2^±30, else with a copy that is scaled, without rounding errors, to a size near 1. Views and buffers of the returned
/// renderer are in the field's own units. The renderer that `make` creates must not keep a reference to its field.
std::unique_ptr<Renderer> inUnitsNearOne(const Field& field, const MakeRenderer& make);

}  // namespace hpsdf::render
