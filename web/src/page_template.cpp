#include "hpsdf/web/page_template.h"

// The assembler includes the file unchanged (.incbin), as in render/src/image/embedded.cpp.
asm(".pushsection .rodata\n"
    ".local hpsdf_page_template\n"
    "hpsdf_page_template:\n"
    ".incbin \"" HPSDF_PAGE_FILE
    "\"\n"
    ".local hpsdf_page_template_end\n"
    "hpsdf_page_template_end:\n"
    ".popsection\n");

extern "C" {
__attribute__((visibility("hidden"))) extern const char hpsdf_page_template[];
__attribute__((visibility("hidden"))) extern const char hpsdf_page_template_end[];
}

namespace hpsdf::web {

std::string_view pageTemplate() { return {hpsdf_page_template, hpsdf_page_template_end}; }

}  // namespace hpsdf::web
