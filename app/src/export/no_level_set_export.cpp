// Replaces level_set_export.cpp in a build without OpenVDB.

#include "export/export_kinds.h"

namespace hpsdf::app {
namespace {

[[noreturn]] void refuseWithoutOpenVdb(const Arguments& arguments) {
  throw Error(ErrorKind::file, arguments.text("output"),
              "this program was built without OpenVDB: install libopenvdb-dev and libnanovdb-dev and build it again; "
              ".vti writes a regular grid without them");
}

}  // namespace

std::vector<ExportKind> levelSetKinds() {
  const std::vector<std::string> settings = {"voxel", "band"};
  return {{".vdb", "a level set for OpenVDB", settings, refuseWithoutOpenVdb, {}},
          {".nvdb", "a level set for NanoVDB", settings, refuseWithoutOpenVdb, {}}};
}

}  // namespace hpsdf::app
