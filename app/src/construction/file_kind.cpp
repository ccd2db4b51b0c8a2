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
  if (isMeshFileName(name) || isGridName(name)) return FileKind::surface;
  return lowerExtension(name) == ".hpsdf" ? FileKind::field : FileKind::unknown;
}

Error unknownKind(const std::string& name) {
  return Error(ErrorKind::file, name,
               "this is neither a field nor a mesh, which are the files that hpsdf opens: it does not begin as field "
               "files do (*.hpsdf), and its name does not end as those of meshes do (OBJ, PLY, STL, OFF, 3DS, glTF) or "
               "those of grids (VDB, VTI, NPY)");
}

}  // namespace hpsdf::app
