#include "console/version.h"

namespace hpsdf::app {

std::string versionText() { return "hpsdf " HPSDF_VERSION; }

}  // namespace hpsdf::app
