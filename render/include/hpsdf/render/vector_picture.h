#pragma once
// Vector pictures for papers, and their SVG and PDF files.

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hpsdf/render/image.h"

namespace hpsdf::render {

/// Points in pixels from the upper left corner of a picture, as in `Image`, joined by straight lines. A line whose
/// first and last points are equal is closed.
using Polyline = std::vector<Eigen::Vector2d>;

/// The area inside an odd number of closed lines.
struct FilledShape {
  std::vector<Polyline> borders;
  Color color;
  double opacity = 1;
};

/// Lines with a width. Lines of one shape may overlap; the shape covers each place once.
struct StrokedShape {
  std::vector<Polyline> lines;
  double width;  ///< pixels
  Color color;
  double opacity = 1;
  bool round = false;               ///< round ends and corners, instead of square ones
  std::vector<double> dashes = {};  ///< lengths of dashes and gaps by turns, pixels; empty for solid lines
  std::string title = {};           ///< what browsers show while the pointer is over the lines
};

/// The part of a text that lies at its position.
enum class TextAnchor : std::uint8_t { start, middle, end };

/// A line of text in DejaVu Sans.
struct TextShape {
  std::string text;          ///< UTF-8
  double size;               ///< the em, pixels
  Eigen::Vector2d position;  ///< a point of the baseline
  Color color;
  TextAnchor anchor = TextAnchor::start;
  double rotation = 0;     ///< degrees counter-clockwise about `position`
  std::string title = {};  ///< what browsers show while the pointer is over the text
};

/// A picture of pixels that is scaled to a rectangle.
struct RasterShape {
  Image image;
  Eigen::AlignedBox2d box;
};

using VectorShape = std::variant<FilledShape, StrokedShape, TextShape, RasterShape>;

/// Shapes that belong together, in the order in which they are painted.
struct VectorLayer {
  std::string name;  ///< a word that names the layer in an SVG file; may be empty if there is no clip
  std::vector<VectorShape> shapes = {};
  std::optional<Eigen::AlignedBox2d> clip = {};  ///< the part of the picture that the shapes may cover
};

/// A picture of shapes. It can be enlarged without limit, and its texts remain texts.
struct VectorPicture {
  int width = 0;  ///< pixels, of which `dpi` make an inch
  int height = 0;
  double dpi = kScreenDpi;
  std::vector<VectorLayer> layers = {};  ///< the first one lies at the bottom
};

/// Returns the picture as the text of an SVG file. Its texts name the font DejaVu Sans. The bytes depend on nothing but
/// the arguments. In an HTML page, shapes of the colour `ink` have the colour of the text around the picture.
std::string svgBytes(const VectorPicture& picture, std::optional<Color> ink = {});

/// Returns the picture as the bytes of a PDF file, into which the letters that occur are embedded. The bytes depend on
/// nothing but the picture. Throws `Error` if the library was built without cairo.
std::string pdfBytes(const VectorPicture& picture);

/// Returns true if the library was built with cairo, and therefore can write PDF files.
bool writesPdf();

/// Throws `Error` unless `writesPdf()` is true.
void requirePdf();

/// Returns true if the file's extension is that of a vector picture, .svg or .pdf.
bool isVectorFile(const std::filesystem::path& file);

/// Writes the picture as SVG, or as PDF if the file's extension is .pdf, to a temporary file that is then renamed to
/// `file`. Throws `Error`, which names the file, if that fails, and as `pdfBytes` does.
void saveVectorPicture(const VectorPicture& picture, const std::filesystem::path& file);

}  // namespace hpsdf::render
