#include "hpsdf/error.h"
#include "hpsdf/render/vector_picture.h"

namespace hpsdf::render {

void requirePdf() {
  throw Error(
      "this build writes no PDF files, because libcairo2-dev was not there when it was built; name an .svg file");
}

std::string pdfBytes(const VectorPicture&) {
  requirePdf();
  return {};
}

}  // namespace hpsdf::render
