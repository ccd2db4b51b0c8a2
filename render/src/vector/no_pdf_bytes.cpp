#include "hpsdf/render/vector_picture.h"

namespace hpsdf::render {

bool writesPdf() { return false; }

std::string pdfBytes(const VectorPicture&) {
  requirePdf();
  return {};
}

}  // namespace hpsdf::render
