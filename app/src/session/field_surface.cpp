#include "session/field_surface.h"

#include <fmt/format.h>

#include <filesystem>

#include "construction/reference_surface.h"
#include "construction/surface.h"
#include "hpsdf/error.h"

namespace hpsdf::app {

Parameter surfaceParameter() {
  return {
      "mesh", text("MESH").positional(),
      "The surface from which the field was made: a mesh file, builtin:SHAPE or analytic:SHAPE, or the expression of "
      "'hpsdf combine' in quotes. It may be left out "
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

/// Returns the mesh file or shape from which the current field was made, or "" if it is unknown.
static std::string knownSurface(const CurrentField& current) {
  if (!current.surface.empty()) return current.surface;
  const std::string& source = current.field.metadata().source.name;
  return isShape(source) ? source : meshBeside(current);
}

std::string surfaceOf(const CurrentField& current, const char* asked) {
  if (std::string known = knownSurface(current); !known.empty()) return known;
  const std::string& source = current.field.metadata().source.name;
  const std::optional<Exactness>& exactness = current.field.metadata().source.exactness;
  if (exactness && *exactness != Exactness::everywhere)
    throw Error(fmt::format("{} was made from {}: {}", current.name, source, kNeedsTriangles));
  if (exactness)
    throw Error(
        fmt::format("{}: this needs the solids that it was made from; give {} as an expression with the paths of "
                    "its files: '{}'",
                    current.name, asked, source));
  throw Error(fmt::format("{}: this needs the mesh that it was made from; give {}{}", current.name, asked,
                          source.empty() ? "" : ", " + source));
}

bool findsSurface(const CurrentField& current) { return !knownSurface(current).empty(); }

void refuseForeign(const CurrentField& current, const ReferenceSurface& reference, const std::string& surface,
                   std::string_view otherwise) {
  if (reference.fieldIsMadeFromIt) return;
  const Source& source = current.field.metadata().source;
  if (reference.distance->source().name == source.name)
    throw Error(
        fmt::format("{} was made from {}, but the contents of these files were others than in {}; give the path{}",
                    current.name, source.name, surface, otherwise));
  throw Error(fmt::format("{} was made from {}, not from {}; give that{}{}", current.name,
                          source.name.empty() ? "something unknown" : source.name, surface,
                          source.exactness ? "" : " mesh", otherwise));
}

}  // namespace hpsdf::app
