#include "pictures/picture_commands.h"

#include <fmt/format.h>

#include <bit>
#include <limits>
#include <span>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/render/picture.h"
#include "pictures/picture_arguments.h"
#include "session/backend.h"
#include "session/field_argument.h"
#include "session/session.h"
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

/// Returns the numbers that the colours of a slice stand for; NaN outside the domain.
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
  reportPicture(session, arguments, file, picture.width, picture.height, renderer.description());
}

void runRender(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  requirePng(file);
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
  reportPicture(session, arguments, file, picture.width, picture.height, renderer.description());
}

using render::ColorBy;

const Command kSlice = {
    .name = "slice",
    .summary = "Draw a plane through a field, coloured by degree, depth, distance, jumps or errors.",
    .help =
        "The plane is perpendicular to an axis, or given by a point and a normal. Colours by degree and depth show the "
        "cells with their outlines; colours by distance show iso-lines and the surface as a heavy line.\n"
        "\n"
        "The extension of the output decides what is written: .png is a picture with legend and caption. .csv (columns "
        "x,y,z,value,degree,depth, one row for each pixel in the domain) and .pfm (32-bit floats, NaN outside the "
        "domain) hold raw values of as many pixels as size says: distances, or in a .pfm the quantity that color "
        "names.",
    .examples = {"hpsdf slice bunny.hpsdf -o degree.png",
                 "hpsdf slice bunny.hpsdf -o distance.png --axis x --offset 0.2 --color distance",
                 "hpsdf slice bunny.hpsdf -o oblique.png --plane 0,0,0,1,1,0 --color depth",
                 "hpsdf slice bunny.hpsdf -o error.png --color error --mesh bunny.obj --range 1e-6,1e-3",
                 "hpsdf slice bunny.hpsdf -o values.csv --size 64x64"},
    .action = runSlice};

const std::vector<Parameter> kSlicePlane = {
    {.name = "output",
     .type = ParameterType::outputPath,
     .help = "File to write: *.png, *.pfm or *.csv.",
     .alias = 'o',
     .need = Need::always},
    {.name = "axis",
     .type = ParameterType::choice,
     .help = "Axis to which the plane is perpendicular.",
     .defaultText = "z",
     .choices = {"x", "y", "z"},
     .group = "Plane"},
    {.name = "offset",
     .type = ParameterType::number,
     .help = "Coordinate at which the plane crosses that axis. When left out, 0, or the domain's middle where 0 lies "
             "outside.",
     .unit = "world units",
     .group = "Plane"},
    {.name = "plane",
     .type = ParameterType::numbers,
     .help = "Point and normal of the plane, instead of axis and offset.",
     .valueName = "PX,PY,PZ,NX,NY,NZ",
     .unit = "world units",
     .counts = {6},
     .group = "Plane"},
    {.name = "zoom",
     .type = ParameterType::number,
     .help = "Magnification; 1 shows the whole section.",
     .defaultText = "1",
     .minimum = 0,
     .minimumExcluded = true,
     .group = "Plane"},
    {.name = "target",
     .type = ParameterType::numbers,
     .help = "Point in the middle of the picture, projected onto the plane; the section's middle when left out.",
     .valueName = "X,Y,Z",
     .unit = "world units",
     .counts = {3},
     .group = "Plane"}};

const Command kRender = {
    .name = "render",
    .summary = "Draw the surface of a field by sphere tracing.",
    .help =
        "The surface is where the distance is 0, or equals an offset: positive offsets thicken the body, negative "
        "ones make it thinner. The camera turns around the centre of the domain. Planes, cells and arrows can be "
        "drawn with the surface or without it.",
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
    .action = runRender};

const std::vector<Parameter> kRenderCamera = {
    {.name = "output",
     .type = ParameterType::outputPath,
     .help = "File to write, *.png.",
     .alias = 'o',
     .need = Need::always},
    {.name = "camera",
     .type = ParameterType::numbers,
     .help =
         "Azimuth and elevation in degrees, and the distance of the eye from the centre in diagonals of the domain.",
     .defaultText = "30,20,1.1",
     .valueName = "AZIMUTH,ELEVATION,DISTANCE",
     .counts = {3}},
    {.name = "target",
     .type = ParameterType::numbers,
     .help = "Point in the middle of the picture, around which the camera turns; the domain's centre when left out. A "
             "small distance in camera shows it from nearby.",
     .valueName = "X,Y,Z",
     .unit = "world units",
     .counts = {3}},
    {.name = "up",
     .type = ParameterType::choice,
     .help = "Axis that points up in the picture.",
     .defaultText = "y",
     .choices = {"y", "z"}},
    {.name = "projection",
     .type = ParameterType::choice,
     .help = "orthographic uses parallel rays, so that lengths can be compared anywhere in the picture; at the target "
             "its scale is that of perspective.",
     .defaultText = "perspective",
     .choices = {"perspective", "orthographic"}}};

const std::vector<Parameter> kRenderDrawn = {
    {.name = "offset",
     .type = ParameterType::number,
     .help = "Distance whose level set is drawn.",
     .defaultText = "0",
     .unit = "world units",
     .group = "What is drawn"},
    {.name = "clip",
     .type = ParameterType::choice,
     .help =
         "Cuts the body across this axis. The half towards the camera is left out, and the section shows the cells in "
         "the colours of the picture.",
     .choices = {"x", "y", "z"}},
    {.name = "clip-offset",
     .type = ParameterType::number,
     .help = "Coordinate at which the cut crosses that axis.",
     .defaultText = "0",
     .unit = "world units"},
    {.name = "cracks",
     .type = ParameterType::flag,
     .help = "Marks cracks in magenta: pixels in which the field jumps across the drawn distance from one cell to the "
             "next. The caption names the widest jump.",
     .defaultText = "false"},
    {.name = "defects",
     .type = ParameterType::text,
     .help = "Marks the defects of this mesh as 'mesh --picture' does. own is the mesh from which the field was made, "
             "where that is known.",
     .valueName = "MESH|own"},
    {.name = "surface",
     .type = ParameterType::flag,
     .help = "Draws the surface. --surface=false shows planes and cells alone.",
     .defaultText = "true"},
    {.name = "plane",
     .type = ParameterType::numbers,
     .help =
         "Also draws a section of the domain in the colours of the picture, with outlined cells and the surface as a "
         "line: across an axis, or through a point with a normal.",
     .valueName = "x|y|z|PX,PY,PZ,NX,NY,NZ",
     .unit = "world units",
     .choices = {"x", "y", "z"},
     .counts = {6},
     .group = "What is drawn"},
    {.name = "plane-offset",
     .type = ParameterType::number,
     .help = "Coordinate at which such a plane crosses its axis. When left out, 0, or the domain's middle where 0 lies "
             "outside.",
     .unit = "world units"},
    {.name = "cells",
     .type = ParameterType::choice,
     .help =
         "Also draws the cells of the octree: lines along their edges, faded where cells are small in the picture, or "
         "boxes of 0.8 of their extent in the colours of the picture.",
     .defaultText = "none",
     .choices = {"none", "lines", "boxes"}},
    {.name = "degrees",
     .type = ParameterType::text,
     .help = "Draws cells of these polynomial degrees only: numbers and ranges, as in 2,4-6.",
     .valueName = "LIST"},
    {.name = "depths",
     .type = ParameterType::text,
     .help = "Draws cells of these depths only: numbers and ranges, as in 2,4-6.",
     .valueName = "LIST"}};

Parameter viewParameter() {
  return {.name = "view",
          .type = ParameterType::choice,
          .help =
              "Named direction instead of camera: front faces -z (with z up: y), right faces -x, corner follows a "
              "diagonal of the cube.",
          .choices = viewNames()};
}

const std::vector<Parameter> kPictureParameters = {
    {.name = "size",
     .type = ParameterType::size,
     .help = "Size of the whole picture, with legend and caption.",
     .defaultText = "1280x720",
     .unit = "pixels",
     .minimum = 16,
     .maximum = 16384,
     .whole = true,
     .counts = {2}},
    {.name = "samples",
     .type = ParameterType::wholeNumber,
     .help = "Number of samples a pixel along each axis. Use 4 for smooth pictures to print; the time grows with its "
             "square.",
     .defaultText = "1",
     .minimum = 1,
     .maximum = 8},
    {.name = "arrows",
     .type = ParameterType::wholeNumber,
     .help =
         "Distance between arrows that show the gradient, at least 4; 0 draws none. An arrow is 0.8 of that long where "
         "the gradient has length 1 and lies in the plane of the picture.",
     .defaultText = "0",
     .unit = "pixels",
     .minimum = 0,
     .maximum = 1000}};

Parameter colorParameter(ColorBy without, const std::string& ofCells, const std::string& standard) {
  return {.name = "color",
          .type = ParameterType::choice,
          .help = ofCells +
                  " value-jump and gradient-jump show the greatest jump at a cell's faces, slope the difference of the "
                  "gradient's length from 1, error the difference from the exact distance, difference the difference "
                  "from another field, cell-error the estimated RMS error of a cell.",
          .defaultText = standard,
          .choices = colorNames(without)};
}

const std::vector<Parameter> kColorScale = {
    {.name = "range",
     .type = ParameterType::numbers,
     .help =
         "Values of the darkest and the lightest colour of a jump, slope or error, or distances between which colours "
         "and iso-lines are chosen. Use it to compare pictures; when left out, it is chosen from the values.",
     .valueName = "LOW,HIGH",
     .counts = {2}},
    {.name = "scale",
     .type = ParameterType::choice,
     .help = "Scale of the colours between these values.",
     .defaultText = "log",
     .choices = {"log", "linear"}},
    {.name = "levels",
     .type = ParameterType::numbers,
     .help = "Degrees or depths that the legend shows in addition to those of the field. Use it to compare pictures of "
             "several fields.",
     .valueName = "LOWEST,HIGHEST",
     .minimum = 0,
     .maximum = kMaxDegree,
     .whole = true,
     .counts = {2}},
    {.name = "mesh",
     .type = ParameterType::text,
     .help =
         "The surface from which the field was made, for --color error. It is known already for built-in and analytic "
         "shapes, and for a mesh that was built in the same script.",
     .defaultText = "",
     .valueName = "MESH",
     .group = "Colours"},
    {.name = "other",
     .type = ParameterType::path,
     .help = "The field to compare with, for --color difference.",
     .valueName = "FIELD",
     .group = "Colours"}};

}  // namespace

void addPictureCommands(Registry& registry) {
  Command slice = kSlice, render = kRender;
  slice.parameters =
      joined({{fieldParameter()},
              kSlicePlane,
              {colorParameter(ColorBy::normal, "degree and depth show the cells, distance iso-lines.", "degree")},
              kColorScale,
              kPictureParameters,
              backendParameters()});
  render.parameters =
      joined({{fieldParameter()},
              kRenderCamera,
              {viewParameter()},
              kRenderDrawn,
              {colorParameter(ColorBy::distance,
                              "normal lights the surface; degree and depth show the cells that hold it.", "normal")},
              kColorScale,
              kPictureParameters,
              backendParameters()});
  registry.add(std::move(slice));
  registry.add(std::move(render));
}

}  // namespace hpsdf::app
