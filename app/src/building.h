#pragma once
// From a mesh file or a shape's name to a field, as `build` and `report` do it.

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/mesh_report.h"
#include "session.h"

namespace hpsdf::app {

/// The parameters of a construction, shared by `build` and `report`.
std::vector<Parameter> buildParameters();

/// The options that such arguments ask for. --paper gives way to what is written beside it.
BuildOptions buildOptions(const Arguments& arguments);

/// The width of blended zones.
Parameter blendWidthParameter(std::string name);

/// A field as the construction left it, with the continuity that such arguments ask for.
Field madeContinuous(Field field, const Arguments& arguments);

struct BuiltField {
  Field field;
  std::shared_ptr<const DistanceFunction> exact;  ///< what it was made from
  std::optional<MeshReport> mesh;                 ///< nothing for an analytic shape
  double seconds = 0;                             ///< of the construction, with the hierarchy over the triangles
};

/// Throws `Error` naming `surface`, `Cancelled` after Ctrl-C. Progress and warnings go to the console's `err`.
BuiltField buildField(const Console& console, const std::string& surface, const Arguments& arguments);

/// Whether it names a shape rather than a file: builtin:… or analytic:…
bool isShape(std::string_view surface);

/// The exact distance of a mesh file or a shape, in the units of a field that was made from `source`. Warns when the
/// surface is another one. Throws `Error` naming `surface`.
std::shared_ptr<const DistanceFunction> exactDistance(const Console& console, const std::string& surface,
                                                      const Source& source);

/// The report of a mesh file or a built-in shape; throws `Error` for an analytic one.
MeshReport inspectSurface(const std::string& surface);

}  // namespace hpsdf::app
