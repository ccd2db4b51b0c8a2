#include "image/embedded.h"

#include <cassert>

// The assembler takes each file in as it stands: any size, no generated source.
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

HPSDF_EMBED(font, HPSDF_FONT_FILE)
HPSDF_EMBED(bodies_frag, HPSDF_SHADER_DIR "/bodies.frag")
HPSDF_EMBED(bodies_vert, HPSDF_SHADER_DIR "/bodies.vert")
HPSDF_EMBED(field_glsl, HPSDF_SHADER_DIR "/field.glsl")
HPSDF_EMBED(full_screen_vert, HPSDF_SHADER_DIR "/full_screen.vert")
HPSDF_EMBED(leaves_alone_glsl, HPSDF_SHADER_DIR "/leaves_alone.glsl")
HPSDF_EMBED(leaves_blended_glsl, HPSDF_SHADER_DIR "/leaves_blended.glsl")
HPSDF_EMBED(slice_frag, HPSDF_SHADER_DIR "/slice.frag")
HPSDF_EMBED(surface_glsl, HPSDF_SHADER_DIR "/surface.glsl")
HPSDF_EMBED(surface_vert, HPSDF_SHADER_DIR "/surface.vert")
HPSDF_EMBED(surface_hit_frag, HPSDF_SHADER_DIR "/surface_hit.frag")
HPSDF_EMBED(surface_march_frag, HPSDF_SHADER_DIR "/surface_march.frag")

namespace hpsdf::render {
namespace {

std::string_view text(const unsigned char* begin, const unsigned char* end) {
  return {reinterpret_cast<const char*>(begin), reinterpret_cast<const char*>(end)};
}

}  // namespace

std::span<const unsigned char> dejavuSans() { return {hpsdf_embedded_font, hpsdf_embedded_font_end}; }

std::string_view shaderText(std::string_view name) {
  if (name == "bodies.frag") return text(hpsdf_embedded_bodies_frag, hpsdf_embedded_bodies_frag_end);
  if (name == "bodies.vert") return text(hpsdf_embedded_bodies_vert, hpsdf_embedded_bodies_vert_end);
  if (name == "field.glsl") return text(hpsdf_embedded_field_glsl, hpsdf_embedded_field_glsl_end);
  if (name == "full_screen.vert") return text(hpsdf_embedded_full_screen_vert, hpsdf_embedded_full_screen_vert_end);
  if (name == "leaves_alone.glsl") return text(hpsdf_embedded_leaves_alone_glsl, hpsdf_embedded_leaves_alone_glsl_end);
  if (name == "leaves_blended.glsl")
    return text(hpsdf_embedded_leaves_blended_glsl, hpsdf_embedded_leaves_blended_glsl_end);
  if (name == "slice.frag") return text(hpsdf_embedded_slice_frag, hpsdf_embedded_slice_frag_end);
  if (name == "surface.glsl") return text(hpsdf_embedded_surface_glsl, hpsdf_embedded_surface_glsl_end);
  if (name == "surface.vert") return text(hpsdf_embedded_surface_vert, hpsdf_embedded_surface_vert_end);
  if (name == "surface_hit.frag") return text(hpsdf_embedded_surface_hit_frag, hpsdf_embedded_surface_hit_frag_end);
  if (name == "surface_march.frag")
    return text(hpsdf_embedded_surface_march_frag, hpsdf_embedded_surface_march_frag_end);
  assert(false && "no such shader");
  return {};
}

}  // namespace hpsdf::render
