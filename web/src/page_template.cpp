#include "hpsdf/web/page_template.h"

// The assembler includes the files unchanged (.incbin), as in render/src/image/embedded.cpp.
#define HPSDF_EMBED_PART(symbol, file)                                    \
  asm(".pushsection .rodata\n"                                            \
      ".local " #symbol "\n" #symbol                                      \
      ":\n"                                                               \
      ".incbin \"" file                                                   \
      "\"\n"                                                              \
      ".local " #symbol "_end\n" #symbol                                  \
      "_end:\n"                                                           \
      ".popsection\n");                                                   \
  extern "C" {                                                            \
  __attribute__((visibility("hidden"))) extern const char symbol[];       \
  __attribute__((visibility("hidden"))) extern const char symbol##_end[]; \
  }

HPSDF_EMBED_PART(hpsdf_page_template, HPSDF_PAGE_FOLDER "/page.html")
HPSDF_EMBED_PART(hpsdf_page_program, HPSDF_PAGE_FOLDER "/program.html")

namespace hpsdf::web {

std::string_view pageTemplate() { return {hpsdf_page_template, hpsdf_page_template_end}; }

std::string_view pageProgram() { return {hpsdf_page_program, hpsdf_page_program_end}; }

}  // namespace hpsdf::web
