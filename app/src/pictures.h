#pragma once
// From validated arguments to the settings of render.

#include "hpsdf/render/picture.h"
#include "registry.h"
#include "session.h"

namespace hpsdf::app {

/// Of --gl alone.
render::GlChoice glChoice(const Arguments& arguments);

/// Throws `Error` when --cpu and --gl are both given.
Backend backend(const Arguments& arguments);

/// Of a parameter that takes three numbers and was given.
Vector3 pointOf(const Arguments& arguments, const char* name);

/// Throws `Error` when plane and axis are both given.
render::SlicePicture slicePicture(const Arguments& arguments);

/// Throws `Error` for a camera out of range, or options that exclude or need each other. Its plane is the one asked
/// for, or, in a domain, lies where nobody said otherwise.
render::SurfacePicture surfacePicture(const Arguments& arguments);
render::SurfacePicture surfacePicture(const Arguments& arguments, const Box& domain);

/// Where a slice across an axis lies when nobody says: at 0, or where the domain does not hold that, in its middle.
double defaultOffset(const Box& domain, int axis);

}  // namespace hpsdf::app
