#include "session/field_argument.h"

#include <filesystem>
#include <utility>

#include "hpsdf/field_file.h"

namespace hpsdf::app {

Parameter fieldParameter() {
  return {"field", file("FIELD").positional().requiredOnCommandLine(),
          "The file of a field. A script may leave it out and works on the current field then."};
}

void loadField(Session& session, const std::string& file) {
  Field field = load(file);
  session.setField({std::move(field), file, std::filesystem::file_size(file)});
}

void useField(Session& session, const Arguments& arguments) {
  if (arguments.has("field")) return loadField(session, arguments.text("field"));
  session.current();  // throws `Error` if there is no field
}

}  // namespace hpsdf::app
