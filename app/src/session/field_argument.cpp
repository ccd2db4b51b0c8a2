#include "session/field_argument.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "construction/file_kind.h"
#include "session/field_surface.h"

namespace hpsdf::app {

Parameter fieldParameter() {
  return {"field", file("FIELD").positional().requiredOnCommandLine(),
          "The file of a field. A script may leave it out and works on the current field then."};
}

void loadField(Session& session, const std::string& file) {
  Field field = loadOrMap(file);
  session.setField({std::move(field), file, std::filesystem::file_size(file)});
}

void useField(Session& session, const Arguments& arguments) {
  if (arguments.has("field")) return loadField(session, arguments.text("field"));
  session.current();  // throws `Error` if there is no field
}

std::string useFieldWithSurface(Session& session, const Arguments& arguments) {
  const std::string field = arguments.textOr("field", "");
  const FileKind kind = field.empty() ? FileKind::field : kindOfFile(field);
  if (kind == FileKind::surface) {
    if (arguments.named("field"))
      throw Error(ErrorKind::field, field,
                  "this is a mesh or a shape, not a field; name the file of a field (*.hpsdf), or give the surface as "
                  "mesh");
    if (session.hasField() && !arguments.has("mesh")) return field;
    throw Error(
        fmt::format("{}: this is a mesh or a shape; give the file of a field (*.hpsdf) first, then the mesh", field));
  }
  if (kind == FileKind::unknown && std::filesystem::exists(field)) throw unknownKind(field);
  useField(session, arguments);
  return arguments.has("mesh") ? arguments.text("mesh") : surfaceOf(session.current());
}

}  // namespace hpsdf::app
