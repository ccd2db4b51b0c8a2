#include "pictures/picture_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/render/picture.h"
#include "pictures/picture_arguments.h"
#include "pictures/picture_names.h"
#include "session/backend.h"
#include "session/field_argument.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

enum class SliceFormat : std::uint8_t { png, pfm, csv };

SliceFormat sliceFormat(const std::string& file) {
  const std::string kind = lowerExtension(file);
  if (kind == ".png") return SliceFormat::png;
  if (kind == ".pfm") return SliceFormat::pfm;
  if (kind == ".csv") return SliceFormat::csv;
  throw Error(fmt::format("{}: unknown kind of output '{}'; expected .png for a picture, .pfm or .csv for raw values",
                          file, kind));
}

/// What the colours of a slice would stand for; NaN outside the domain.
std::vector<float> rawValues(const Field& field, const render::SliceView& view, const render::ViewBuffers& buffers,
                             render::ColorBy what, const render::ReferenceData& reference) {
  if (render::isQuantity(what)) return render::quantityAt(field, view, buffers, what, reference);
  std::vector<float> values(buffers.cell.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < values.size(); ++i)
    if (buffers.hit(i))
      values[i] = what == render::ColorBy::degree  ? buffers.degree[i]
                  : what == render::ColorBy::depth ? buffers.depth[i]
                                                   : buffers.value[i];
  return values;
}

/// Portable float map: one channel, little-endian (the negative scale says so), rows bottom to top; NaN outside the
/// domain.
void writePfm(const render::ViewBuffers& buffers, std::span<const float> values, OutputFile& out) {
  static_assert(std::endian::native == std::endian::little, "a PFM row is written as it lies in memory");
  out.write(fmt::format("Pf\n{} {}\n-1.0\n", buffers.width, buffers.height));
  const auto width = static_cast<std::size_t>(buffers.width);
  for (auto y = static_cast<std::size_t>(buffers.height); y-- > 0;)
    out.write(std::as_bytes(values.subspan(y * width, width)));
}

/// A row a pixel inside the domain: its point in world units, the value there, degree and depth of its cell.
void writeCsv(const render::SliceView& view, const render::ViewBuffers& buffers, OutputFile& out) {
  out.write("x,y,z,value,degree,depth\n");
  for (int y = 0; y < buffers.height; ++y) {
    std::string rows;
    for (int x = 0; x < buffers.width; ++x) {
      const std::size_t pixel = std::size_t(y) * std::size_t(buffers.width) + std::size_t(x);
      if (!buffers.hit(pixel)) continue;
      const Vector3 p = render::pixelPoint(view, x, y, buffers.width, buffers.height);
      rows += fmt::format("{},{},{},{},{},{}\n", p.x(), p.y(), p.z(), buffers.value[pixel], buffers.degree[pixel],
                          buffers.depth[pixel]);
    }
    out.write(rows);
  }
}

void report(Session& session, const Arguments& arguments, int width, int height, const render::Renderer& renderer) {
  const std::string file = arguments.text("output");
  if (session.wantsJson(arguments))
    return printJson(session.console().out,
                     {{"output", file}, {"width", width}, {"height", height}, {"renderer", renderer.description()}});
  session.console().out << fmt::format("{}: {}x{}, {}\n", file, width, height, renderer.description());
}

void runSlice(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  const SliceFormat format = sliceFormat(file);
  render::SlicePicture picture = slicePicture(arguments);
  if (format != SliceFormat::png && picture.samples != 1)
    throw Error(fmt::format("{}: raw values take one sample a pixel; leave out samples", file));
  if (format != SliceFormat::png && picture.arrows != 0)
    throw Error(fmt::format("{}: raw values have no arrows; leave out arrows", file));
  if (format == SliceFormat::png) render::checkPictureSize(picture.width, picture.height, picture.samples);
  const Backend chosen = backend(arguments);
  checkWritable(file);
  useField(session, arguments);
  const render::ReferenceData reference = referenceDataFor(session, arguments, picture);
  render::Renderer& renderer = session.renderer(chosen);
  const Field& field = session.current().field;
  picture = slicePicture(arguments, field.domain());
  if (format == SliceFormat::png) {
    session.setPicture(render::drawSlice(renderer, field, picture, reference));
    savePng(session.picture().image, file);
  } else {
    const render::SliceView view = render::sliceView(field, picture, picture.width, picture.height);
    const render::ViewBuffers buffers = renderer.slice(view, picture.width, picture.height);
    OutputFile out(file);
    if (format == SliceFormat::pfm)
      writePfm(buffers,
               rawValues(field, view, buffers, arguments.given("color") ? picture.color : render::ColorBy::distance,
                         reference),
               out);
    else
      writeCsv(view, buffers, out);
    out.commit();
  }
  report(session, arguments, picture.width, picture.height, renderer);
}

void runRender(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  if (lowerExtension(file) != ".png") throw Error(fmt::format("{}: pictures are written as .png", file));
  render::SurfacePicture picture = surfacePicture(arguments);
  const Backend chosen = backend(arguments);
  checkWritable(file);
  useField(session, arguments);
  const render::ReferenceData reference = referenceDataFor(session, arguments, picture);
  render::Renderer& renderer = session.renderer(chosen);
  const Field& field = session.current().field;
  picture = surfacePicture(arguments, field.domain());
  session.setPicture(render::drawSurface(renderer, field, picture, reference));
  savePng(session.picture().image, file);
  noteOddSurface(session.console(), field, picture, session.picture().seen);
  report(session, arguments, picture.width, picture.height, renderer);
}

std::vector<Parameter> pictureParameters() {
  std::vector<Parameter> parameters = {{.name = "size",
                                        .type = ParameterType::size,
                                        .help = "Of the whole picture, legend and caption included.",
                                        .defaultText = "1280x720",
                                        .unit = "pixels",
                                        .minimum = 16,
                                        .maximum = 16384,
                                        .whole = true,
                                        .counts = {2}},
                                       {.name = "samples",
                                        .type = ParameterType::wholeNumber,
                                        .help = "Samples a pixel along each axis: 4 for a smooth picture to print.",
                                        .defaultText = "1",
                                        .minimum = 1,
                                        .maximum = 8}};
  parameters.push_back({.name = "arrows",
                        .type = ParameterType::wholeNumber,
                        .help = "Arrows along the gradient, so many pixels apart, at least 4; 0 for none. Where its "
                                "length is 1, an arrow is 0.8 of that long, but for what the projection takes from it.",
                        .defaultText = "0",
                        .unit = "pixels",
                        .minimum = 0,
                        .maximum = 1000});
  for (Parameter& parameter : backendParameters()) parameters.push_back(std::move(parameter));
  return parameters;
}

std::vector<Parameter> joined(std::vector<Parameter> first, std::vector<Parameter> more) {
  for (Parameter& parameter : more) first.push_back(std::move(parameter));
  return first;
}

Command withParameters(Command command, std::vector<Parameter> more) {
  for (Parameter& parameter : more) command.parameters.push_back(std::move(parameter));
  return command;
}

using render::ColorBy;

std::vector<Parameter> colorParameters(ColorBy without, const std::string& ofCells, const std::string& standard) {
  return {
      {.name = "color",
       .type = ParameterType::choice,
       .help = ofCells +
               " value-jump and gradient-jump show the greatest jump at a cell's faces, slope how far the gradient's "
               "length is from 1, error the difference from the exact distance, difference that from another field, "
               "cell-error what the construction "
               "thinks of a cell's RMS error.",
       .defaultText = standard,
       .choices = colorNames(without)},
      {.name = "range",
       .type = ParameterType::numbers,
       .help = "Which values the darkest and the lightest colour of a jump, slope or error stand for, or for which "
               "distances colours and iso-lines are chosen, so that pictures can be compared; when left out, chosen "
               "from the values.",
       .valueName = "LOW,HIGH",
       .counts = {2}},
      {.name = "scale",
       .type = ParameterType::choice,
       .help = "How such colours run between them.",
       .defaultText = "log",
       .choices = {"log", "linear"}},
      {.name = "levels",
       .type = ParameterType::numbers,
       .help = "Degrees or depths that the legend has besides the field's own, so that pictures of several fields can "
               "be compared.",
       .valueName = "LOWEST,HIGHEST",
       .minimum = 0,
       .maximum = kMaxDegree,
       .whole = true,
       .counts = {2}},
      {.name = "mesh",
       .type = ParameterType::text,
       .help = "For color error: what the field was made from. A built-in or analytic shape is known; a mesh file "
               "must be given, unless it was built in the same script.",
       .defaultText = "",
       .valueName = "MESH"},
      {.name = "other",
       .type = ParameterType::path,
       .help = "For color difference: the field to compare with.",
       .valueName = "FIELD"}};
}

}  // namespace

void addPictureCommands(Registry& registry) {
  registry.add(withParameters(
      {.name = "slice",
       .summary = "Draw a plane through a field, coloured by degree, depth, distance, jumps or errors.",
       .help =
           "The plane is axis = offset, or any plane given by a point and a normal. degree and depth show the cells "
           "with their outlines; distance shows iso-lines, the surface as a heavy line.\n"
           "\n"
           "The output's ending decides: .png is a picture with legend and caption; .csv (x,y,z,value,degree,depth, a "
           "row a pixel inside) and .pfm (32-bit floats, NaN outside the domain) hold the raw values of size pixels: "
           "distances, or in a .pfm what color names.",
       .examples = {"hpsdf slice bunny.hpsdf -o degree.png",
                    "hpsdf slice bunny.hpsdf -o distance.png --axis x --offset 0.2 --color distance",
                    "hpsdf slice bunny.hpsdf -o oblique.png --plane 0,0,0,1,1,0 --color depth",
                    "hpsdf slice bunny.hpsdf -o error.png --color error --mesh bunny.obj --range 1e-6,1e-3",
                    "hpsdf slice bunny.hpsdf -o values.csv --size 64x64"},
       .parameters =
           {
               fieldParameter(),
               {.name = "output",
                .type = ParameterType::outputPath,
                .help = "*.png, *.pfm or *.csv.",
                .alias = 'o',
                .need = Need::always},
               {.name = "axis",
                .type = ParameterType::choice,
                .help = "The plane is perpendicular to this axis.",
                .defaultText = "z",
                .choices = {"x", "y", "z"}},
               {.name = "offset",
                .type = ParameterType::number,
                .help = "Where the plane crosses that axis; when left out, at 0, or in the domain's middle where 0 "
                        "lies outside.",
                .unit = "world units"},
               {.name = "plane",
                .type = ParameterType::numbers,
                .help = "A point of the plane and its normal, instead of axis and offset.",
                .valueName = "PX,PY,PZ,NX,NY,NZ",
                .unit = "world units",
                .counts = {6}},
               {.name = "zoom",
                .type = ParameterType::number,
                .help = "How many times larger than with the whole section in the picture.",
                .defaultText = "1",
                .minimum = 0,
                .minimumExcluded = true},
               {.name = "target",
                .type = ParameterType::numbers,
                .help = "The point in the picture's middle, moved into the plane; the section's middle when left out.",
                .valueName = "X,Y,Z",
                .unit = "world units",
                .counts = {3}},
           },
       .action = runSlice},
      joined(colorParameters(ColorBy::normal, "degree and depth show the cells, distance iso-lines.", "degree"),
             pictureParameters())));
  registry.add(withParameters(
      {.name = "render",
       .summary = "Draw the surface of a field by sphere tracing.",
       .help = "The surface is where the distance is 0, or the given offset: positive offsets swell it, negative ones "
               "shrink it. The camera circles the centre of the domain.",
       .examples = {"hpsdf render bunny.hpsdf -o surface.png",
                    "hpsdf render bunny.hpsdf -o swollen.png --offset 0.05 --camera 120,10,0.9",
                    "hpsdf render bunny.hpsdf -o degrees.png --color degree --samples 4",
                    "hpsdf render bunny.hpsdf -o inside.png --clip z --color degree",
                    "hpsdf render bunny.hpsdf -o front.png --view front --projection orthographic --cracks",
                    "hpsdf render bunny.hpsdf -o scene.png --plane z --cells boxes --degrees 4-30 --color degree",
                    "hpsdf render bunny.hpsdf -o cells.png --surface=false --cells lines --depths 0-3",
                    "hpsdf render bunny.hpsdf -o gradients.png --arrows 32",
                    "hpsdf render bunny.hpsdf -o ear.png --camera 30,20,0.3 --target 0.2,0.6,-0.1",
                    "hpsdf render chair.hpsdf -o defects.png --defects chair.obj"},
       .parameters =
           {fieldParameter(),
            {.name = "output", .type = ParameterType::outputPath, .help = "*.png.", .alias = 'o', .need = Need::always},
            {.name = "camera",
             .type = ParameterType::numbers,
             .help = "Azimuth and elevation in degrees, and the eye's distance from the centre in diagonals of "
                     "the domain.",
             .defaultText = "30,20,1.1",
             .valueName = "AZIMUTH,ELEVATION,DISTANCE",
             .counts = {3}},
            {.name = "view",
             .type = ParameterType::choice,
             .help = "A named direction instead of camera: front looks along -z (with z up: along y), right from +x, "
                     "corner along a diagonal of the cube.",
             .choices = viewNames()},
            {.name = "target",
             .type = ParameterType::numbers,
             .help = "The point in the picture's middle, which the camera circles; the domain's centre when left out. "
                     "With a small distance in camera, a close look at it.",
             .valueName = "X,Y,Z",
             .unit = "world units",
             .counts = {3}},
            {.name = "up",
             .type = ParameterType::choice,
             .help = "The axis that points up in the picture.",
             .defaultText = "y",
             .choices = {"y", "z"}},
            {.name = "projection",
             .type = ParameterType::choice,
             .help = "orthographic looks along parallel rays, so that lengths can be compared wherever they are; at "
                     "the target the picture is as high as in perspective.",
             .defaultText = "perspective",
             .choices = {"perspective", "orthographic"}},
            {.name = "offset",
             .type = ParameterType::number,
             .help = "The distance whose surface is drawn.",
             .defaultText = "0",
             .unit = "world units"},
            {.name = "clip",
             .type = ParameterType::choice,
             .help = "Cut across this axis: the half towards the camera is left out, and the section shows the cells "
                     "in the picture's colours.",
             .choices = {"x", "y", "z"}},
            {.name = "clip-offset",
             .type = ParameterType::number,
             .help = "Where the cut crosses that axis.",
             .defaultText = "0",
             .unit = "world units"},
            {.name = "cracks",
             .type = ParameterType::flag,
             .help = "Mark in magenta where the surface is torn: the field jumps over the distance drawn from one cell "
                     "to the next. The caption has the widest jump.",
             .defaultText = "false"},
            {.name = "defects",
             .type = ParameterType::text,
             .help = "Mark where this mesh has defects, as 'mesh --picture' does: own for the one that the field was "
                     "made from, where that is known.",
             .valueName = "MESH|own"},
            {.name = "surface",
             .type = ParameterType::flag,
             .help = "Whether the surface is drawn: without it, planes and cells can be looked at alone.",
             .defaultText = "true"},
            {.name = "plane",
             .type = ParameterType::numbers,
             .help = "Also draw the domain's section with a plane, in the picture's colours, its cells outlined, the "
                     "surface as a line: across this axis, or through a point with a normal.",
             .valueName = "x|y|z|PX,PY,PZ,NX,NY,NZ",
             .unit = "world units",
             .choices = {"x", "y", "z"},
             .counts = {6}},
            {.name = "plane-offset",
             .type = ParameterType::number,
             .help = "Where such a plane crosses its axis; when left out, at 0, or in the domain's middle where 0 lies "
                     "outside.",
             .unit = "world units"},
            {.name = "cells",
             .type = ParameterType::choice,
             .help = "Also draw the octree's cells: as lines along their edges, those of cells that are small in the "
                     "picture faded, or as boxes of 0.8 of their extent in the picture's colours.",
             .defaultText = "none",
             .choices = {"none", "lines", "boxes"}},
            {.name = "degrees",
             .type = ParameterType::text,
             .help = "Only cells of these polynomial degrees: numbers and ranges, as in 2,4-6.",
             .valueName = "LIST"},
            {.name = "depths",
             .type = ParameterType::text,
             .help = "Only cells of these depths in the octree.",
             .valueName = "LIST"}},
       .action = runRender},
      joined(colorParameters(ColorBy::distance,
                             "normal lights the surface; degree and depth show the cells that hold it.", "normal"),
             pictureParameters())));
}

}  // namespace hpsdf::app
