#pragma once
// Converts the validated arguments of commands into settings of the renderer.

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

/// Returns the name of a colour mode in commands: normal, degree, value-jump, ….
std::string_view colorName(render::ColorBy color);
std::vector<std::string> colorNames(std::optional<render::ColorBy> without = {});

/// Returns the names of the colour maps that suit a colour mode, or of all maps. Modes with fixed colours have none.
std::vector<std::string> mapNames(std::optional<render::ColorBy> color = {});
/// Throws `Error` unless the map suits the colour mode. The empty name, which means the default map, suits all.
void checkMap(const std::string& map, render::ColorBy color);

/// Returns a sentence for help texts. It explains the colour modes that show a quantity, such as the error.
std::string quantityHelp();

/// Returns the colour mode of this name, which must be one of `colorNames()`.
render::ColorBy colorNamed(std::string_view name);

/// Returns the names of the camera directions: front, back, ….
std::vector<std::string> viewNames();
/// Turns the camera to the direction named `view`, which must be one of `viewNames`.
void turnTo(render::OrbitCamera& camera, std::string_view view);
/// Returns the name of the camera's direction, or "" if the direction has no name.
std::string viewName(const render::OrbitCamera& camera);

/// Returns the name of the axis that points up.
std::string upName(const render::OrbitCamera& camera);

/// Returns the style in which cells are drawn, by its name: none, lines or boxes.
render::CellStyle cellStyle(std::string_view name);
std::string cellStyleName(render::CellStyle style);

/// Parses a list of degrees or depths such as "2,4-6". Each number must lie between 0 and `most`. A list of
/// degrees may contain the word "exact". Returns an empty list
/// for "". Throws `Error` naming the parameter `name` for any other text.
std::vector<int> levelList(const std::string& text, const char* name, int most);
/// Returns a list of degrees or depths as text: "2,4", or "all" for an empty list.
std::string levelText(const std::vector<int>& levels);

/// Returns the line of a script that places the explorer's camera.
std::string cameraLine(const render::OrbitCamera& camera);

/// Returns the lines of a script by which the explorer shows what a picture shows, as far as pages can show it.
std::string viewScript(const render::SlicePicture& picture);
std::string viewScript(const render::SurfacePicture& picture);

/// Returns the value of a parameter of three numbers as a point. The parameter must have a value.
Vector3 pointOf(const Arguments& arguments, const char* name);

/// A placeholder for the result of `shownBox`, with which arguments can be checked before the field is loaded.
inline const Box kAnyBox(Vector3::Constant(-1), Vector3::Constant(1));

/// Returns the colour scale from the arguments `range`, `scale` and `map`. Throws `Error` if one of them, or `mesh`
/// or `other`, is not for the quantity that `color` names, or if that needs another argument.
render::ScaleOptions scaleOptions(const Arguments& arguments);

/// Returns the settings of a picture from the arguments of `slice`. If no offset is given, the plane is at
/// `defaultOffset` of `box`. Throws `Error` if both a plane and an axis are given.
render::SlicePicture slicePicture(const Arguments& arguments, const Box& box = kAnyBox);

/// Names of the parameters of `render` that all commands with a camera share.
inline constexpr std::array kCameraParameters = {"camera", "view",    "target", "projection",
                                                 "size",   "samples", "cpu",    "gl"};
std::vector<Parameter> cameraParameters(const Registry& registry);

/// Makes a renderer for the meshes. `backend` chooses between OpenGL and the CPU.
std::unique_ptr<render::BodyRenderer> makeBodyRenderer(std::vector<TriangleMesh> meshes, const Backend& backend);

/// Returns the settings of a picture from the arguments named in `kCameraParameters`. Throws `Error` if the
/// camera or the size is out of range.
render::SurfacePicture cameraPicture(const Arguments& arguments);

/// Returns the settings of a picture from the arguments of `render`. If no offset is given, a plane or a cut is at
/// `defaultOffset` of `box`. Throws `Error` if the camera is out of range, if two given parameters exclude each other,
/// or if a given parameter needs another one.
render::SurfacePicture surfacePicture(const Arguments& arguments, const Box& box = kAnyBox);

/// Writes a note to the console if the picture is empty, or if the walls of the domain cut off the surface.
void noteOddSurface(const Console& console, const Field& field, const render::SurfacePicture& picture, bool seen);

/// Returns the data that a picture needs in addition to the current field, such as the exact distance for error
/// colours. The data comes from the files that the arguments name.
render::ReferenceData referenceDataFor(Session& session, const Arguments& arguments,
                                       const render::SlicePicture& picture);
render::ReferenceData referenceDataFor(Session& session, const Arguments& arguments,
                                       const render::SurfacePicture& picture);

/// Formats the coordinates of v with the fewest digits that are read back as the same numbers.
std::string coordinatesText(const Vector3& v);

/// Returns the part of the domain that holds the surface. Returns the domain if the field does not know the surface's
/// box.
Box shownBox(const Field& field);

/// Returns the default offset of a plane perpendicular to an axis: the middle of `box`, rounded to about a thousandth
/// of its size, so that captions and commands have a short number.
double defaultOffset(const Box& box, int axis);

/// Throws `Error` unless the file ends in .png.
void requirePng(const std::string& file);

/// Throws `Error` unless the file is one that `savePicture` can write: .png, .svg or, where this build can, .pdf.
void requirePicture(const std::string& file);

/// Writes a picture in the form that the file's extension names.
void savePicture(const render::Image& image, const render::VectorPicture& vectors, const std::string& file);

/// Returns the parameters that tell how many pixels make an inch, and whether the background is left out.
std::vector<Parameter> formParameters();

/// Returns the form of a picture of pixels from the arguments of `formParameters`.
render::PictureForm pictureForm(const Arguments& arguments);

/// Reports a picture that has been written, in one line, or as a JSON object if the arguments ask for JSON.
void reportPicture(Session& session, const Arguments& arguments, const std::string& file, int width, int height,
                   const std::string& renderer);

}  // namespace hpsdf::app
