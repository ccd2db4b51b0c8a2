#pragma once
// Rendering of very large and very small fields: devices compute in float, in which the square of a length overflows
// above 1e19 and vanishes below 1e-19.

#include <functional>
#include <memory>

#include "hpsdf/render/renderer.h"

namespace hpsdf::render {

using MakeRenderer = std::function<std::unique_ptr<Renderer>(const Field&)>;

/// A renderer for the field that lets `make` work with lengths near 1. Calls `make` with the field itself where
/// its domain's size lies within 2^±30, else with a copy in units of a power of two, which rounds nothing. Views
/// and buffers of the result are in the field's own units. The renderer that `make` returns must keep no reference
/// to the field.
std::unique_ptr<Renderer> inUnitsNearOne(const Field& field, const MakeRenderer& make);

}  // namespace hpsdf::render
