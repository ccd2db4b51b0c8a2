#pragma once
// Converts validated arguments, and names as commands spell them, into the renderer's settings.

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

/// Names of the quantities that colours show: degree, depth, distance, ….
std::string_view colorName(render::ColorBy color);
std::vector<std::string> colorNames(std::optional<render::ColorBy> without = {});
render::ColorBy colorNamed(std::string_view name);

/// Names of a camera's directions: front, back, ….
std::vector<std::string> viewNames();
/// Turns the camera into a direction that `viewNames` contains.
void turnTo(render::OrbitCamera& camera, std::string_view view);
/// The name of the camera's direction; "" if it has none.
std::string viewName(const render::OrbitCamera& camera);

/// The names are none, lines and boxes.
render::CellStyle cellStyle(std::string_view name);
std::string cellStyleName(render::CellStyle style);

/// The levels in a list such as "2,4-6", each from 0 to `most`; none for "". Throws `Error` naming the parameter.
std::vector<int> levelList(const std::string& text, const char* name, int most);

/// The point that a parameter of three numbers holds, which must have been given.
Vector3 pointOf(const Arguments& arguments, const char* name);

/// Stands for the domain of a field that is not loaded yet, when arguments are checked.
inline const Box kAnyDomain(Vector3::Constant(-1), Vector3::Constant(1));

/// The settings of `slice`. Without an offset the plane is at `defaultOffset`. Throws `Error` when plane and axis are
/// both given.
render::SlicePicture slicePicture(const Arguments& arguments, const Box& domain = kAnyDomain);

/// The parameters of `render` that every picture with a camera takes.
inline constexpr std::array kCameraParameters = {"camera", "view",    "target", "projection",
                                                 "size",   "samples", "cpu",    "gl"};
std::vector<Parameter> cameraParameters(const Registry& registry);

/// A renderer of these meshes, by OpenGL or on the CPU.
std::unique_ptr<render::BodyRenderer> makeBodyRenderer(std::vector<TriangleMesh> meshes, const Backend& backend);

/// The settings that `kCameraParameters` give. Throws `Error` for a camera or a size out of range.
render::SurfacePicture cameraPicture(const Arguments& arguments);

/// The settings of `render`. Without an offset the plane is at `defaultOffset`. Throws `Error` for a camera out of
/// range, and for parameters that exclude or need each other.
render::SurfacePicture surfacePicture(const Arguments& arguments, const Box& domain = kAnyDomain);

/// Writes a note that explains an empty picture, or a surface that is cut off by the walls of the domain.
void noteOddSurface(const Console& console, const Field& field, const render::SurfacePicture& picture, bool seen);

/// The reference data that a picture of the session's field needs, from the files that the arguments name.
render::ReferenceData referenceDataFor(Session& session, const Arguments& arguments,
                                       const render::SlicePicture& picture);
render::ReferenceData referenceDataFor(Session& session, const Arguments& arguments,
                                       const render::SurfacePicture& picture);

/// Default offset of a plane across an axis: 0, or the domain's middle if 0 lies outside.
double defaultOffset(const Box& domain, int axis);

/// Throws `Error` unless the file ends in .png.
void requirePng(const std::string& file);

/// Reports a picture that was written: one line, or a JSON object if the arguments ask for it.
void reportPicture(Session& session, const Arguments& arguments, const std::string& file, int width, int height,
                   const std::string& renderer);

}  // namespace hpsdf::app
