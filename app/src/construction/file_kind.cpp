#include "construction/file_kind.h"

#include <filesystem>

#include "construction/surface.h"
#include "hpsdf/detail/text.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"

namespace hpsdf::app {

FileKind kindOfFile(const std::string& name) {
  if (isShape(name)) return FileKind::surface;
  std::error_code missing;
  if (std::filesystem::is_regular_file(name, missing) && isFieldFile(name)) return FileKind::field;
  if (isMeshFileName(name)) return FileKind::surface;
  return lowerExtension(name) == ".hpsdf" ? FileKind::field : FileKind::unknown;
}

}  // namespace hpsdf::app
