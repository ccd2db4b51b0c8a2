#include "console/console.h"

#include <ostream>

#include "text/printable.h"

namespace hpsdf::app {

void note(const Console& console, std::string_view text) {
  console.err << "hpsdf: note: " << printable(text) << std::endl;
}

void warn(const Console& console, std::string_view text) {
  console.err << "hpsdf: warning: " << printable(text) << std::endl;
}

}  // namespace hpsdf::app
