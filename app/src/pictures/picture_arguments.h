#pragma once
// From validated arguments to the settings of render.

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/render/picture.h"
#include "language/registry.h"
#include "session/backend.h"
#include "session/session.h"

namespace hpsdf::app {

/// "2,4-6" → 2, 4, 5, 6; empty for "". Throws `Error` naming the parameter.
std::vector<int> levelList(const std::string& text, const char* name, int most);

/// Of a parameter that takes three numbers and was given.
Vector3 pointOf(const Arguments& arguments, const char* name);

/// Throws `Error` when plane and axis are both given. Its plane is the one asked for, or, in a domain, lies where
/// nobody said otherwise: at 0, or where the domain does not hold that, in its middle.
render::SlicePicture slicePicture(const Arguments& arguments);
render::SlicePicture slicePicture(const Arguments& arguments, const Box& domain);

/// The parameters of `render` that any picture before a camera takes.
inline constexpr std::array kLooks = {"camera", "view", "target", "projection", "size", "samples", "cpu", "gl"};
std::vector<Parameter> lookParameters(const Registry& registry);

/// Draws these meshes, by OpenGL or on the CPU.
std::unique_ptr<render::BodyRenderer> makeBodyRenderer(std::vector<TriangleMesh> meshes, const Backend& backend);

/// What any picture before a camera takes: camera, view, target, projection, size and samples. Throws `Error` for a
/// camera or a size out of range.
render::SurfacePicture cameraPicture(const Arguments& arguments);

/// Throws `Error` for a camera out of range, or options that exclude or need each other. Its plane is the one asked
/// for, or, in a domain, lies where nobody said otherwise.
render::SurfacePicture surfacePicture(const Arguments& arguments);
render::SurfacePicture surfacePicture(const Arguments& arguments, const Box& domain);

/// Tells what explains an empty picture, or an open shell.
void noteOddSurface(const Console& console, const Field& field, const render::SurfacePicture& picture, bool seen);

/// What a picture of the session's field draws besides, by a command's arguments.
render::ReferenceData referenceDataFor(Session& session, const Arguments& arguments,
                                       const render::SlicePicture& picture);
render::ReferenceData referenceDataFor(Session& session, const Arguments& arguments,
                                       const render::SurfacePicture& picture);

/// Where a slice across an axis lies when nobody says: at 0, or where the domain does not hold that, in its middle.
double defaultOffset(const Box& domain, int axis);

}  // namespace hpsdf::app
