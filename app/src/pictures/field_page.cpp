#include "pictures/field_page.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <sstream>
#include <utility>

#include "files/output_folder.h"
#include "files/text_file.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/field_file.h"
#include "hpsdf/render/blend_zone_bounds.h"
#include "hpsdf/render/markup.h"
#include "hpsdf/render/picture.h"
#include "hpsdf/web/page_template.h"
#include "language/script.h"
#include "pictures/picture_arguments.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

// A browser reads the text of an element up to 512 MiB, and holds it several times while it opens the page.
constexpr double kMostFieldBytes = 256e6;

constexpr std::array kViewCommands = {"show", "camera", "surface", "plane", "cells", "color", "worst"};
/// Commands that `copy-view` writes besides, about what pages do not have. A page passes over them.
constexpr std::array kOtherViewCommands = {"triangles", "arrows", "beside", "panel"};

bool contains(std::span<const char* const> words, std::string_view word) {
  return std::ranges::find(words, word) != words.end();
}

/// Returns the bytes of the field's file.
std::string bytesOf(const Field& field) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "field.hpsdf";
  save(field, file);
  return readWholeFile(file.string());
}

/// Returns the bytes of the field that a page holds: those of its file and, if it is blended, the blend zone bounds of
/// each node, which a browser would compute for a long time.
std::string payloadOf(const Field& field) {
  std::string bytes = bytesOf(field);
  for (const render::BlendZoneBounds& zone : render::blendZoneBounds(field))
    for (const float bound : {zone.valueDifference, zone.gradientDifference, zone.extent})
      bytes.append(reinterpret_cast<const char*>(&bound), sizeof bound);
  return bytes;
}

/// Compresses bytes by zlib, which browsers can undo.
std::string compressed(const std::string& bytes, const Progress& progress) {
  constexpr std::size_t kBytesPerUpdate = std::size_t{1} << 20;
  z_stream stream = {};
  if (deflateInit(&stream, Z_BEST_COMPRESSION) != Z_OK)
    throw Error(ErrorKind::limit, "page", "the field cannot be compressed: there is too little memory");
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, deflateEnd);
  std::string result(deflateBound(&stream, bytes.size()), '\0');
  stream.next_out = reinterpret_cast<Bytef*>(result.data());
  stream.avail_out = static_cast<uInt>(result.size());
  for (std::size_t at = 0; at < bytes.size(); at += kBytesPerUpdate) {
    progress.update("compressing", double(at) / double(bytes.size()));
    const std::size_t count = std::min(kBytesPerUpdate, bytes.size() - at);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data() + at));
    stream.avail_in = static_cast<uInt>(count);
    deflate(&stream, at + count == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
  }
  result.resize(stream.total_out);
  return result;
}

using Marks = std::vector<std::pair<std::string_view, std::string>>;

/// Returns the text with each mark replaced. What replaces one is not searched for marks.
std::string filled(std::string_view text, const Marks& marks) {
  std::string result;
  for (std::size_t begin = text.find("{{"); begin != std::string_view::npos; begin = text.find("{{")) {
    const auto isHere = [&](const auto& mark) { return text.substr(begin).starts_with(mark.first); };
    const auto mark = std::ranges::find_if(marks, isHere);
    result += text.substr(0, begin);
    result += mark == marks.end() ? "{{" : mark->second;
    text.remove_prefix(begin + (mark == marks.end() ? 2 : mark->first.size()));
  }
  return result += text;
}

std::string figure(const PagePicture& picture) {
  return fmt::format("<figure><img src=\"{0}\" alt=\"{1}\"><figcaption>{1}</figcaption></figure>\n",
                     htmlPng(picture.png), render::escapedMarkup(picture.title));
}

/// Gives those of the files that have no name yet the name `nameOf(file)` if it is that of no other file.
template <typename NameOf>
void nameUnique(std::vector<std::string>& names, const std::vector<std::string>& files, const NameOf& nameOf) {
  std::map<std::string, int> counts;
  for (const std::string& file : files) ++counts[nameOf(file)];
  for (std::size_t n = 0; n < files.size(); ++n)
    if (const std::string name = nameOf(files[n]); names[n].empty() && counts[name] == 1) names[n] = name;
}

}  // namespace

std::string refusal(const Field& field) {
  if (double(field.bytes()) > kMostFieldBytes)
    return fmt::format("takes {}, more than the {} that a page holds; build it with a greater target error",
                       bytesText(double(field.bytes())), bytesText(kMostFieldBytes));
  return {};
}

void FieldPage::add(const Field& field, const FieldInPage& described, const Progress& progress) {
  if (const std::string reason = refusal(field); !reason.empty()) throw Error(ErrorKind::field, described.name, reason);
  bytes_ += double(field.bytes());
  if (bytes_ > kMostFieldBytes)
    throw Error(
        ErrorKind::limit, described.name,
        fmt::format("with this field the page holds more than {}; write several pages", bytesText(kMostFieldBytes)));
  requireMemory("a page with these fields", 5 * bytes_, "write several pages");
  const std::string view =
      described.view.empty() ? "" : fmt::format(" data-view=\"{}\"", render::escapedMarkup(described.view));
  fields_ += fmt::format("<script type=\"application/octet-stream\" class=\"field\" data-name=\"{}\"{}>",
                         render::escapedMarkup(described.name), view);
  fields_ += render::base64(compressed(payloadOf(field), progress));
  fields_ += "</script>\n";
  for (const PagePicture& picture : described.pictures) pictures_ += figure(picture);
}

std::string FieldPage::html(const std::string& title) const {
  return filled(web::pageTemplate(),
                {{"{{title}}", render::escapedMarkup(title)},
                 {"{{fields}}", fields_},
                 {"{{pictures}}", pictures_},
                 {"{{program}}", render::base64(compressed(std::string(web::pageProgram()), {}))}});
}

std::vector<PagePicture> fallbackPictures(render::Renderer& renderer, const Field& field, const std::string& name) {
  constexpr int kWidth = 400, kHeight = 300, kSamples = 2;
  render::SurfacePicture surface;
  surface.width = kWidth;
  surface.height = kHeight;
  surface.samples = kSamples;
  const render::SlicePicture slice{.plane = render::AxisPlane{2, defaultOffset(shownBox(field), 2)},
                                   .color = render::ColorBy::degree,
                                   .width = kWidth,
                                   .height = kHeight,
                                   .samples = kSamples};
  return {{name + ": the surface", pngBytes(render::draw(renderer, field, surface))},
          {name + ": the polynomial degrees of the cells in a plane", pngBytes(render::draw(renderer, field, slice))}};
}

std::vector<std::string> distinctNames(const std::vector<std::string>& files) {
  std::vector<std::string> names(files.size());
  nameUnique(names, files, [](const std::string& file) { return plainName(file); });
  nameUnique(names, files, [](const std::string& file) {
    const std::string folder = std::filesystem::absolute(file).parent_path().filename().string();
    return printable(folder) + "/" + plainName(file);
  });
  std::map<std::string, int> numbers;
  for (std::size_t n = 0; n < files.size(); ++n)
    if (names[n].empty()) names[n] = fmt::format("{} ({})", plainName(files[n]), ++numbers[plainName(files[n])]);
  return names;
}

std::string pageView(const std::string& script) {
  std::istringstream lines(script);
  std::string view;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string command;
    words >> command;
    if (contains(kViewCommands, command)) view += line + "\n";
  }
  return view;
}

void checkPageView(const Registry& registry, std::string_view view) {
  for (const Call& call : parseScript(registry, "view", view, {}))
    if (!contains(kViewCommands, call.command->name) && !contains(kOtherViewCommands, call.command->name))
      throw Error(ErrorKind::option, "",
                  fmt::format("{}: {} is no command about a view; these are {}", call.where, call.command->name,
                              fmt::join(kViewCommands, ", ")));
}

}  // namespace hpsdf::app
