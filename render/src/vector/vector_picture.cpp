#include "hpsdf/render/vector_picture.h"

#include <algorithm>
#include <cctype>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"

namespace hpsdf::render {
namespace {

bool endsIn(const std::filesystem::path& file, std::string_view wanted) {
  const std::string extension = file.extension().string();
  return std::ranges::equal(extension, wanted, [](char a, char b) { return std::tolower(a) == b; });
}

}  // namespace

void requirePdf() {
  if (!writesPdf())
    throw Error(
        "this build writes no PDF files, because libcairo2-dev was not there when it was built; name an .svg file");
}

bool isVectorFile(const std::filesystem::path& file) { return endsIn(file, ".svg") || endsIn(file, ".pdf"); }

void saveVectorPicture(const VectorPicture& picture, const std::filesystem::path& file) {
  OutputFile output(file);
  output.write(endsIn(file, ".pdf") ? pdfBytes(picture) : svgBytes(picture));
  output.commit();
}

}  // namespace hpsdf::render
