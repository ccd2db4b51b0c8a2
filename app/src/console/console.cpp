#include "console/console.h"

#include <ostream>

#include "hpsdf/error.h"
#include "text/text.h"

namespace hpsdf::app {

void note(const Console& console, std::string_view text) {
  console.err << "hpsdf: note: " << printable(text) << std::endl;
}

void warn(const Console& console, std::string_view text) {
  console.err << "hpsdf: warning: " << printable(text) << std::endl;
}

void requireWritten(const std::ostream& out) {
  if (!out) throw Error("cannot write to standard output: its reader has gone, or the disk is full");
}

}  // namespace hpsdf::app
