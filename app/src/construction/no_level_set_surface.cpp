// Replaces level_set_surface.cpp in a build without OpenVDB.

#include "construction/grid_surface.h"

namespace hpsdf::app {

GridDistance readLevelSet(const Console&, const std::string& file) {
  throw Error(ErrorKind::file, file,
              "this program was built without OpenVDB: install libopenvdb-dev and libnanovdb-dev and build it again; "
              "grids of VTK (.vti) and NumPy (.npy) can be read without them");
}

}  // namespace hpsdf::app
