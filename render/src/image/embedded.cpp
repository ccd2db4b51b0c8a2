#include "image/embedded.h"

#include <cassert>

// Embeds a file in the library. The assembler includes the file unchanged (.incbin), which allows any file size
// and needs no generated source.
#define HPSDF_EMBED(symbol, file)                                                                   \
  asm(".pushsection .rodata\n"                                                                      \
      ".balign 16\n"                                                                                \
      ".local hpsdf_embedded_" #symbol                                                              \
      "\n"                                                                                          \
      "hpsdf_embedded_" #symbol                                                                     \
      ":\n"                                                                                         \
      ".incbin \"" file                                                                             \
      "\"\n"                                                                                        \
      ".local hpsdf_embedded_" #symbol                                                              \
      "_end\n"                                                                                      \
      "hpsdf_embedded_" #symbol                                                                     \
      "_end:\n"                                                                                     \
      ".popsection\n");                                                                             \
  extern "C" {                                                                                      \
  __attribute__((visibility("hidden"))) extern const unsigned char hpsdf_embedded_##symbol[];       \
  __attribute__((visibility("hidden"))) extern const unsigned char hpsdf_embedded_##symbol##_end[]; \
  }

#define HPSDF_FOR_EACH_SHADER(use)                                                                    \
  use(bodies_frag, "bodies.frag") use(bodies_vert, "bodies.vert") use(field_glsl, "field.glsl")       \
      use(full_screen_vert, "full_screen.vert") use(leaves_alone_glsl, "leaves_alone.glsl")           \
          use(leaves_blended_glsl, "leaves_blended.glsl") use(leaves_exact_glsl, "leaves_exact.glsl") \
              use(leaves_polynomial_glsl, "leaves_polynomial.glsl") use(slice_frag, "slice.frag")     \
                  use(surface_glsl, "surface.glsl") use(surface_vert, "surface.vert")                 \
                      use(surface_hit_frag, "surface_hit.frag") use(surface_march_frag, "surface_march.frag")
#define HPSDF_EMBED_SHADER(symbol, name) HPSDF_EMBED(symbol, HPSDF_SHADER_DIR "/" name)

HPSDF_EMBED(font, HPSDF_FONT_FILE)
HPSDF_FOR_EACH_SHADER(HPSDF_EMBED_SHADER)

namespace hpsdf::render {
namespace {

std::string_view text(const unsigned char* begin, const unsigned char* end) {
  return {reinterpret_cast<const char*>(begin), reinterpret_cast<const char*>(end)};
}

}  // namespace

std::span<const unsigned char> dejavuSans() { return {hpsdf_embedded_font, hpsdf_embedded_font_end}; }

std::string_view shaderText(std::string_view name) {
#define HPSDF_RETURN_IF_NAMED(symbol, file) \
  if (name == file) return text(hpsdf_embedded_##symbol, hpsdf_embedded_##symbol##_end);
  HPSDF_FOR_EACH_SHADER(HPSDF_RETURN_IF_NAMED)
  assert(false && "no such shader");
  return {};
}

}  // namespace hpsdf::render
