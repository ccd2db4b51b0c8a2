#include "session/field_surface.h"

#include <fmt/format.h>

#include <filesystem>

#include "construction/surface.h"
#include "hpsdf/error.h"

namespace hpsdf::app {

Parameter surfaceParameter() {
  return {
      "mesh", text("MESH").positional(),
      "The surface from which the field was made: a mesh file, builtin:SHAPE or analytic:SHAPE. It may be left out "
      "where the field was made from a built-in or analytic shape, or where the mesh lies beside the field or in the "
      "current folder under its name."};
}

/// Returns the mesh file with the name that the field stores, in the folder of the field's file or in the current
/// folder. Returns "" if there is none.
static std::string meshBeside(const CurrentField& current) {
  const std::filesystem::path name = std::filesystem::path(current.field.metadata().source.name).filename();
  if (name.empty()) return "";
  for (const std::filesystem::path& folder : {std::filesystem::path(current.name).parent_path(), {}}) {
    std::error_code ignored;
    if (std::filesystem::is_regular_file(folder / name, ignored)) return (folder / name).string();
  }
  return "";
}

std::string surfaceOf(const CurrentField& current, const char* asked) {
  const std::string& source = current.field.metadata().source.name;
  if (!current.surface.empty()) return current.surface;
  if (isShape(source)) return source;
  if (std::string file = meshBeside(current); !file.empty()) return file;
  throw Error(fmt::format("{}: this needs the mesh that it was made from; give {}{}", current.name, asked,
                          source.empty() ? "" : ", " + source));
}

bool findsSurface(const CurrentField& current) {
  return !current.surface.empty() || isShape(current.field.metadata().source.name) || !meshBeside(current).empty();
}

void refuseForeign(const CurrentField& current, const ReferenceSurface& reference, const std::string& surface,
                   std::string_view otherwise) {
  if (reference.fieldIsMadeFromIt) return;
  const std::string& source = current.field.metadata().source.name;
  throw Error(fmt::format("{} was made from {}, not from {}; give that mesh{}", current.name,
                          source.empty() ? "something unknown" : source, surface, otherwise));
}

}  // namespace hpsdf::app
