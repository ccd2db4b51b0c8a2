#include <cairo-ft.h>
#include <cairo-pdf.h>
#include <cairo.h>
#include <ft2build.h>

#include <cmath>
#include <cstdint>
#include <memory>

#include "hpsdf/error.h"
#include "hpsdf/render/font.h"
#include "hpsdf/render/vector_picture.h"
#include "image/text.h"
#include FT_FREETYPE_H

namespace hpsdf::render {
namespace {

constexpr double kPointsPerInch = 72;
constexpr double kRasterMargin = 0.01;  // pixels

using CairoSurface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using CairoContext = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;
using CairoFont = std::unique_ptr<cairo_font_face_t, decltype(&cairo_font_face_destroy)>;

void checkCairo(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw Error("cannot write the picture as PDF: " + std::string(cairo_status_to_string(status)));
}

/// Returns the built-in font for cairo.
CairoFont embeddedFont() {
  // Cairo keeps fonts for later use, perhaps until the process ends. Each has a library of its own, because those of
  // FreeType must not be used by several threads at a time.
  FT_Library library = nullptr;
  FT_Face face = nullptr;
  const std::span<const unsigned char> bytes = dejavuSans();
  if (FT_Init_FreeType(&library) != 0 ||
      FT_New_Memory_Face(library, bytes.data(), FT_Long(bytes.size()), 0, &face) != 0) {
    FT_Done_FreeType(library);
    throw Error("cannot write the picture as PDF: FreeType does not read the built-in font");
  }
  CairoFont font(cairo_ft_font_face_create_for_ft_face(face, FT_LOAD_NO_HINTING), cairo_font_face_destroy);
  static const cairo_user_data_key_t key = {};
  const auto release = [](void* data) { FT_Done_FreeType(static_cast<FT_Library>(data)); };  // and its face
  if (const auto status = cairo_font_face_set_user_data(font.get(), &key, library, release);
      status != CAIRO_STATUS_SUCCESS) {
    font.reset();
    release(library);
    checkCairo(status);
  }
  return font;
}

/// Paints shapes into a PDF page, in pixels.
class PdfPainter {
 public:
  PdfPainter(cairo_t* context, cairo_font_face_t* font) : context_(context) { cairo_set_font_face(context_, font); }

  void paint(const VectorLayer& layer) {
    cairo_save(context_);
    if (layer.clip) {
      const Eigen::Vector2d size = layer.clip->sizes();
      cairo_rectangle(context_, layer.clip->min().x(), layer.clip->min().y(), size.x(), size.y());
      cairo_clip(context_);
    }
    for (const VectorShape& shape : layer.shapes) std::visit([&](const auto& ofKind) { paintShape(ofKind); }, shape);
    cairo_restore(context_);
  }

 private:
  void setColor(Color color, double opacity) {
    cairo_set_source_rgba(context_, color[0] / 255.0, color[1] / 255.0, color[2] / 255.0, opacity);
  }

  void addPath(const std::vector<Polyline>& lines) {
    for (const Polyline& line : lines) {
      if (line.empty()) continue;
      const bool isClosed = line.size() > 2 && line.front() == line.back();
      cairo_move_to(context_, line[0].x(), line[0].y());
      for (std::size_t n = 1; n + (isClosed ? 1 : 0) < line.size(); ++n)
        cairo_line_to(context_, line[n].x(), line[n].y());
      if (line.size() == 1) cairo_line_to(context_, line[0].x(), line[0].y());
      if (isClosed) cairo_close_path(context_);
    }
  }

  void paintShape(const FilledShape& shape) {
    setColor(shape.color, shape.opacity);
    cairo_set_fill_rule(context_, CAIRO_FILL_RULE_EVEN_ODD);
    addPath(shape.borders);
    cairo_fill(context_);
  }

  void paintShape(const StrokedShape& shape) {
    setColor(shape.color, shape.opacity);
    cairo_set_line_width(context_, shape.width);
    cairo_set_line_cap(context_, shape.round ? CAIRO_LINE_CAP_ROUND : CAIRO_LINE_CAP_BUTT);
    cairo_set_line_join(context_, shape.round ? CAIRO_LINE_JOIN_ROUND : CAIRO_LINE_JOIN_MITER);
    cairo_set_dash(context_, shape.dashes.data(), int(shape.dashes.size()), 0);
    addPath(shape.lines);
    cairo_stroke(context_);
  }

  void paintShape(const TextShape& shape) {
    std::string text;
    std::vector<cairo_glyph_t> glyphs;
    std::vector<cairo_text_cluster_t> clusters;  // which bytes each glyph stands for, so that the text can be searched
    for (const Glyph& glyph : glyphsOf(shape.text, shape.size)) {
      text += glyph.text;
      glyphs.push_back({static_cast<unsigned long>(glyph.index), glyph.x, 0});
      clusters.push_back({int(glyph.text.size()), 1});
    }
    cairo_save(context_);
    cairo_translate(context_, shape.position.x(), shape.position.y());
    cairo_rotate(context_, -shape.rotation * M_PI / 180);
    const double share = shape.anchor == TextAnchor::start ? 0 : shape.anchor == TextAnchor::middle ? 0.5 : 1;
    cairo_translate(context_, -share * advanceOf(shape.text, shape.size), 0);
    cairo_set_font_size(context_, shape.size);
    setColor(shape.color, 1);
    cairo_show_text_glyphs(context_, text.data(), int(text.size()), glyphs.data(), int(glyphs.size()), clusters.data(),
                           int(clusters.size()), cairo_text_cluster_flags_t(0));
    cairo_restore(context_);
  }

  void paintShape(const RasterShape& shape) {
    const Image& image = shape.image;
    const CairoSurface surface(
        cairo_image_surface_create(image.alpha.empty() ? CAIRO_FORMAT_RGB24 : CAIRO_FORMAT_ARGB32, image.width,
                                   image.height),
        cairo_surface_destroy);
    checkCairo(cairo_surface_status(surface.get()));
    unsigned char* bytes = cairo_image_surface_get_data(surface.get());
    const int stride = cairo_image_surface_get_stride(surface.get());
    for (int y = 0; y < image.height; ++y) {
      auto* row = reinterpret_cast<std::uint32_t*>(bytes + std::ptrdiff_t(y) * stride);
      for (int x = 0; x < image.width; ++x) row[x] = premultiplied(image, x, y);
    }
    cairo_surface_mark_dirty(surface.get());
    cairo_save(context_);
    // Poppler widens a picture that ends where a pixel begins by this pixel, and so scales the whole picture.
    const Eigen::Vector2d least = shape.box.min().array() + kRasterMargin,
                          size = shape.box.max().array() - kRasterMargin - least.array();
    cairo_translate(context_, least.x(), least.y());
    cairo_scale(context_, size.x() / image.width, size.y() / image.height);
    cairo_set_source_surface(context_, surface.get(), 0, 0);
    cairo_paint(context_);
    cairo_restore(context_);
  }

  /// Returns a pixel as cairo stores it: alpha, red, green and blue from high to low bits, the colours times alpha.
  static std::uint32_t premultiplied(const Image& image, int x, int y) {
    const std::size_t i = std::size_t(y) * std::size_t(image.width) + std::size_t(x);
    const std::uint32_t alpha = image.alpha.empty() ? 255 : image.alpha[i];
    std::uint32_t pixel = alpha;
    for (const std::uint8_t channel : image.pixels[i]) pixel = pixel << 8 | (channel * alpha + 127) / 255;
    return pixel;
  }

  cairo_t* context_;
};

}  // namespace

bool writesPdf() { return true; }

std::string pdfBytes(const VectorPicture& picture) {
  std::string bytes;
  const auto append = [](void* context, const unsigned char* data, unsigned int size) {
    static_cast<std::string*>(context)->append(reinterpret_cast<const char*>(data), size);
    return CAIRO_STATUS_SUCCESS;
  };
  const double points = kPointsPerInch / picture.dpi;
  const CairoSurface surface(
      cairo_pdf_surface_create_for_stream(append, &bytes, picture.width * points, picture.height * points),
      cairo_surface_destroy);
  // Without this, cairo writes the time of day into the file.
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, "");
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATOR, "hpsdf");
  {
    const CairoContext context(cairo_create(surface.get()), cairo_destroy);
    const CairoFont font = embeddedFont();
    cairo_scale(context.get(), points, points);
    PdfPainter painter(context.get(), font.get());
    for (const VectorLayer& layer : picture.layers) painter.paint(layer);
    checkCairo(cairo_status(context.get()));
  }
  cairo_surface_finish(surface.get());
  checkCairo(cairo_surface_status(surface.get()));
  return bytes;
}

}  // namespace hpsdf::render
