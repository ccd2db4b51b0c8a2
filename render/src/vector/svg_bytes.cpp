#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "hpsdf/render/markup.h"
#include "hpsdf/render/vector_picture.h"
#include "image/text.h"

namespace hpsdf::render {
namespace {

/// Numbers in SVG files have two digits after the point: a hundredth of a pixel is a 400th of a millimetre.
std::int64_t hundredths(double number) { return std::llround(100 * number); }

std::string hundredthsText(std::int64_t number) {
  std::string text = number < 0 ? "-" : "";
  const std::int64_t size = std::abs(number), rest = size % 100;
  if (size >= 100 || rest == 0) text += std::to_string(size / 100);
  if (rest == 0) return text;
  text += '.';
  text += char('0' + rest / 10);
  if (rest % 10 != 0) text += char('0' + rest % 10);
  return text;
}

std::string numberText(double number) { return hundredthsText(hundredths(number)); }

std::string attribute(std::string_view name, const std::string& value) {
  return " " + std::string(name) + "=\"" + value + "\"";
}

std::string attribute(std::string_view name, double number) { return attribute(name, numberText(number)); }

std::string colorText(Color color) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text = "#";
  for (const std::uint8_t channel : color) {
    text += kDigits[channel / 16];
    text += kDigits[channel % 16];
  }
  return text;
}

/// The data of a path. Points are written as steps from the point before, which take fewer letters. The steps lie
/// between rounded points, so that rounding errors do not add up.
class PathText {
 public:
  void add(const Polyline& line) {
    if (line.empty()) return;
    const bool isClosed = line.size() > 2 && line.front() == line.back();
    const std::size_t count = line.size() - (isClosed ? 1 : 0);
    moveTo(line.front());
    for (std::size_t n = 1; n < count; ++n) lineTo(line[n]);
    if (line.size() == 1) text_ += "h0";
    if (isClosed) {
      text_ += 'z';
      x_ = startX_;
      y_ = startY_;
      last_ = 'z';
    }
  }

  const std::string& text() const { return text_; }

 private:
  void moveTo(const Eigen::Vector2d& point) {
    step('m', {hundredths(point.x()) - x_, hundredths(point.y()) - y_});
    startX_ = x_ = hundredths(point.x());
    startY_ = y_ = hundredths(point.y());
  }

  void lineTo(const Eigen::Vector2d& point) {
    const std::int64_t dx = hundredths(point.x()) - x_, dy = hundredths(point.y()) - y_;
    x_ += dx;
    y_ += dy;
    if (dy == 0 && dx != 0)
      step('h', {dx});
    else if (dx == 0 && dy != 0)
      step('v', {dy});
    else if (dx != 0)
      step('l', {dx, dy});
  }

  void step(char command, std::initializer_list<std::int64_t> numbers) {
    bool separated = command != last_;
    if (separated) text_ += command;
    last_ = command == 'm' ? 'l' : command;  // numbers after those of a move are lines
    for (const std::int64_t number : numbers) {
      const std::string shown = hundredthsText(number);
      if (!separated && shown[0] != '-') text_ += ' ';
      text_ += shown;
      separated = false;
    }
  }

  std::string text_;
  std::int64_t x_ = 0, y_ = 0, startX_ = 0, startY_ = 0;
  char last_ = 0;
};

std::string pathData(const std::vector<Polyline>& lines) {
  PathText path;
  for (const Polyline& line : lines) path.add(line);
  return attribute("d", path.text());
}

std::string opacityText(std::string_view name, double opacity) {
  return opacity < 1 ? attribute(name, opacity) : std::string();
}

/// Writes shapes as SVG elements.
class SvgWriter {
 public:
  explicit SvgWriter(std::optional<Color> ink) : ink_(ink) {}

  std::string operator()(const FilledShape& shape) const {
    return "<path" + attribute("fill", paint(shape.color)) + opacityText("fill-opacity", shape.opacity) +
           pathData(shape.borders) + "/>\n";
  }

  std::string operator()(const StrokedShape& shape) const {
    std::string style = attribute("fill", std::string("none")) + attribute("stroke", paint(shape.color)) +
                        attribute("stroke-width", shape.width) + opacityText("stroke-opacity", shape.opacity);
    if (shape.round) style += R"( stroke-linecap="round" stroke-linejoin="round")";
    if (!shape.dashes.empty()) {
      std::string lengths;
      for (const double length : shape.dashes) lengths += (lengths.empty() ? "" : " ") + numberText(length);
      style += attribute("stroke-dasharray", lengths);
    }
    const std::string element = "<path" + style + pathData(shape.lines);
    return shape.title.empty() ? element + "/>\n" : element + ">" + titleText(shape.title) + "</path>\n";
  }

  std::string operator()(const TextShape& shape) const {
    const double x = shape.position.x(), y = shape.position.y();
    std::string place = attribute("x", x) + attribute("y", y);
    if (shape.anchor != TextAnchor::start)
      place += attribute("text-anchor", std::string(shape.anchor == TextAnchor::middle ? "middle" : "end"));
    if (shape.rotation != 0)
      place += attribute("transform",
                         "rotate(" + numberText(-shape.rotation) + " " + numberText(x) + " " + numberText(y) + ")");
    return "<text" + place + attribute("font-size", shape.size) + attribute("fill", paint(shape.color)) + ">" +
           escapedMarkup(lettersOf(shape.text)) + (shape.title.empty() ? std::string() : titleText(shape.title)) +
           "</text>\n";
  }

  std::string operator()(const RasterShape& shape) const {
    return "<image" + attribute("x", shape.box.min().x()) + attribute("y", shape.box.min().y()) +
           attribute("width", shape.box.sizes().x()) + attribute("height", shape.box.sizes().y()) +
           attribute("preserveAspectRatio", std::string("none")) +
           attribute("href", "data:image/png;base64," + base64(pngBytes(shape.image))) + "/>\n";
  }

 private:
  std::string paint(Color color) const { return color == ink_ ? "currentColor" : colorText(color); }

  /// Returns a text whose letters XML allows.
  static std::string lettersOf(const std::string& text) {
    std::string letters;
    for (const Glyph& glyph : glyphsOf(text, 1)) letters += glyph.text;
    return letters;
  }

  static std::string titleText(const std::string& title) {
    return "<title>" + escapedMarkup(lettersOf(title)) + "</title>";
  }

  std::optional<Color> ink_;
};

std::string clipText(const std::string& name, const Eigen::AlignedBox2d& box) {
  return "<clipPath" + attribute("id", name) + "><rect" + attribute("x", box.min().x()) +
         attribute("y", box.min().y()) + attribute("width", box.sizes().x()) + attribute("height", box.sizes().y()) +
         "/></clipPath>\n";
}

}  // namespace

std::string svgBytes(const VectorPicture& picture, std::optional<Color> ink) {
  const SvgWriter write(ink);
  const double cssPixels = kScreenDpi / picture.dpi;  // an inch has 96 CSS pixels
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\"" + attribute("width", picture.width * cssPixels) +
      attribute("height", picture.height * cssPixels) +
      attribute("viewBox", "0 0 " + std::to_string(picture.width) + " " + std::to_string(picture.height)) +
      " font-family=\"DejaVu Sans, Verdana, sans-serif\" fill-rule=\"evenodd\">\n";
  for (const VectorLayer& layer : picture.layers) {
    if (layer.shapes.empty()) continue;
    const std::string clip = layer.name + "-clip";
    if (layer.clip) svg += clipText(clip, *layer.clip);
    svg += "<g" + (layer.name.empty() ? std::string() : attribute("id", layer.name)) +
           (layer.clip ? attribute("clip-path", "url(#" + clip + ")") : std::string()) + ">\n";
    for (const VectorShape& shape : layer.shapes) svg += std::visit(write, shape);
    svg += "</g>\n";
  }
  return svg + "</svg>\n";
}

}  // namespace hpsdf::render
