// Reads level sets of OpenVDB.
#include "console/long_work.h"
#include "construction/grid_surface.h"
#include "hpsdf/openvdb/read_level_set.h"

namespace hpsdf::app {

GridDistance readLevelSet(const Console& console, const std::string& file) {
  return withProgress(console, [&](const Progress& progress) { return vdb::loadVdb(file, 0, progress); });
}

}  // namespace hpsdf::app
