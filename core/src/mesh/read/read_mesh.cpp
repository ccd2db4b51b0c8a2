#include "mesh/read/read_mesh.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "hpsdf/detail/text.h"
#include "mesh/read/assimp_reader.h"
#include "mesh/read/gltf_document.h"
#include "mesh/read/gltf_reader.h"
#include "mesh/read/obj_reader.h"
#include "mesh/read/off_reader.h"
#include "mesh/read/ply_reader.h"
#include "mesh/read/stl_reader.h"
#include "mesh/scan/input.h"

namespace hpsdf::mesh {
namespace {

namespace fs = std::filesystem;

struct MeshFormat {
  std::string_view extension;
  TriangleMesh (*read)(Input&);
  bool mayBeCompressed = false;  ///< the file's name may end in .gz too
};

constexpr std::array<MeshFormat, 7> kFormats = {{{".obj", readObj, true},
                                                 {".ply", readPly, true},
                                                 {".stl", readStl, true},
                                                 {".off", readOff, true},
                                                 {".gltf", readGltf},
                                                 {".glb", readGltf},
                                                 {".3ds", readByAssimp}}};

/// Returns the format of a file by its extension, or a null pointer.
const MeshFormat* formatOf(const fs::path& file) {
  const bool isCompressed = lowerExtension(file) == ".gz";
  const std::string extension = lowerExtension(isCompressed ? file.stem() : file);
  const auto found = std::ranges::find(kFormats, std::string_view(extension), &MeshFormat::extension);
  return found == kFormats.end() || (isCompressed && !found->mayBeCompressed) ? nullptr : &*found;
}

[[noreturn]] void refuseFormat(const fs::path& file) {
  const std::string extension = lowerExtension(file);
  std::string known, compressed;
  for (const MeshFormat& format : kFormats) {
    known += (known.empty() ? "" : ", ") + std::string(format.extension);
    if (format.mayBeCompressed) compressed += ", " + std::string(format.extension) + ".gz";
  }
  throw Error(ErrorKind::file, file.string(),
              (extension.empty() ? "no extension" : "unknown format " + extension) + "; a mesh file ends in one of " +
                  known + compressed);
}

}  // namespace

TriangleMesh readMesh(const fs::path& file, const Progress& progress) {
  Input input(file, progress);
  const MeshFormat* const format = formatOf(file);
  if (!format) refuseFormat(file);
  return format->read(input);
}

bool hasMeshExtension(const fs::path& file) { return formatOf(file) != nullptr; }

bool isReadByOthers(const fs::path& file) {
  const MeshFormat* const format = formatOf(file);
  if (!format || format->read != readGltf) return format && format->read == readByAssimp;
  const Progress none;
  try {
    Input input(file, none);
    while (input.ensure(kDracoExtension.size())) {
      const std::string_view rest = input.rest();
      if (rest.find(kDracoExtension) != rest.npos) return true;
      input.skip(rest.size() - kDracoExtension.size() + 1);
    }
  } catch (const Error&) {
    // The reader will tell what is wrong with the file.
  }
  return false;
}

}  // namespace hpsdf::mesh
