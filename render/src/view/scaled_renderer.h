#pragma once
// Fields whose units are far from 1: devices count in float, whose squares end near 1e19 and vanish near 1e-19.

#include <functional>
#include <memory>

#include "hpsdf/render/renderer.h"

namespace hpsdf::render {

using MakeRenderer = std::function<std::unique_ptr<Renderer>(const Field&)>;

/// What `make` makes of the field, or, where its domain is not near 1 in size (2^±30), of the same field in units of a
/// power of two, which rounds nothing; what it shows is in the field's own units all the same. `make` keeps no
/// reference to the field.
std::unique_ptr<Renderer> inUnitsNearOne(const Field& field, const MakeRenderer& make);

}  // namespace hpsdf::render
