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
#include "session/field_operands.h"
#include "session/session.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

enum class SliceFormat : std::uint8_t { picture, pfm, csv };

SliceFormat sliceFormat(const std::string& file) {
  const std::string kind = lowerExtension(file);
  if (kind == ".pdf") render::requirePdf();
  if (kind == ".png" || render::isVectorFile(file)) return SliceFormat::picture;
  if (kind == ".pfm") return SliceFormat::pfm;
  if (kind == ".csv") return SliceFormat::csv;
  throw Error(fmt::format(
      "{}: unknown kind of output '{}'; expected .png, .svg or .pdf for a picture, .pfm or .csv for raw values", file,
      kind));
}

/// Throws `Error` if the arguments ask for what only pictures have, but not raw values.
void checkRawValues(const std::string& file, const Arguments& arguments, const render::SlicePicture& picture) {
  if (picture.samples != 1) throw Error(fmt::format("{}: raw values take one sample a pixel; leave out samples", file));
  if (picture.arrows != 0) throw Error(fmt::format("{}: raw values have no arrows; leave out arrows", file));
  if (arguments.given("operands"))
    throw Error(fmt::format("{}: raw values have no outlines; leave out operands", file));
  for (const char* name : {"dpi", "transparent"})
    if (arguments.given(name)) throw Error(fmt::format("{}: only pictures have {}; leave it out", file, name));
}

/// Returns for each pixel of a slice the number that its colour represents. The number is NaN for pixels
/// outside the domain.
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

/// Writes the values as a portable float map with one channel. The negative scale in its header states that the map is
/// little-endian. Its rows run from bottom to top. Values outside the domain are NaN.
void writePfm(const render::ViewBuffers& buffers, std::span<const float> values, OutputFile& out) {
  static_assert(std::endian::native == std::endian::little, "a PFM row is written as it lies in memory");
  out.write(fmt::format("Pf\n{} {}\n-1.0\n", buffers.width, buffers.height));
  const auto width = static_cast<std::size_t>(buffers.width);
  for (auto y = static_cast<std::size_t>(buffers.height); y-- > 0;)
    out.write(std::as_bytes(values.subspan(y * width, width)));
}

/// Writes a CSV file with one row for each pixel inside the domain: the pixel's point in world units, the field value,
/// and the degree and depth of the cell.
void writeCsv(const render::SliceView& view, const render::ViewBuffers& buffers, OutputFile& out) {
  out.write("x,y,z,value,degree,depth\n");
  for (int y = 0; y < buffers.height; ++y) {
    std::string rows;
    for (int x = 0; x < buffers.width; ++x) {
      const std::size_t pixel = std::size_t(y) * std::size_t(buffers.width) + std::size_t(x);
      if (!buffers.hit(pixel)) continue;
      const Vector3 p = render::pixelPoint(view, x, y, buffers.width, buffers.height);
      rows += fmt::format("{},{},{},{},{},{}\n", p.x(), p.y(), p.z(), buffers.value[pixel],
                          levelName(buffers.degree[pixel]), buffers.depth[pixel]);
    }
    out.write(rows);
  }
}

/// Loads the field of a call, draws the picture whose settings are `settings(arguments, box)`, and makes it the
/// session's picture, with shapes if it is for the vector file `file`. Returns the settings.
template <typename Settings, typename Draw>
auto drawForSession(Session& session, const Arguments& arguments, const std::string& file, const Settings& settings,
                    const Draw& draw) {
  const auto asked = settings(arguments, kAnyBox);  // throws `Error` for wrong arguments before the field is loaded
  const Backend chosen = backend(arguments);
  useField(session, arguments);
  const render::ReferenceData reference = referenceDataFor(session, arguments, asked);
  render::Renderer& renderer = session.renderer(chosen);
  const Field& field = session.current().field;
  auto picture = settings(arguments, shownBox(field));
  picture.form.vectors = render::isVectorFile(file);
  session.setPicture(draw(renderer, field, picture, reference));
  return picture;
}

/// Draws the slice of a call and makes it the session's picture. `file` is the file for which it is drawn, or "".
void drawSliceFor(Session& session, const Arguments& arguments, const std::string& file) {
  const render::SlicePicture asked = slicePicture(arguments);
  render::checkPictureSize(asked.width, asked.height, asked.samples);
  const auto settings = [](const Arguments& given, const Box& box) { return slicePicture(given, box); };
  drawForSession(session, arguments, file, settings, render::drawSlice);
}

render::Image slicedImage(Session& session, const Arguments& arguments) {
  drawSliceFor(session, arguments, "");
  return session.picture().image;
}

void runSlice(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  const SliceFormat format = sliceFormat(file);
  render::SlicePicture picture = slicePicture(arguments);
  if (format == SliceFormat::picture)
    render::checkPictureSize(picture.width, picture.height, picture.samples);
  else
    checkRawValues(file, arguments, picture);
  const Backend chosen = backend(arguments);
  checkWritable(file);
  if (format == SliceFormat::picture) {
    drawSliceFor(session, arguments, file);
    const render::Drawn& drawn = session.picture();
    savePicture(drawn.image, drawn.vectors, file);
    picture.width = drawn.image.width;
    picture.height = drawn.image.height;
  } else {
    useField(session, arguments);
    const render::ReferenceData reference = referenceDataFor(session, arguments, picture);
    render::Renderer& renderer = session.renderer(chosen);
    const Field& field = session.current().field;
    picture = slicePicture(arguments, shownBox(field));
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
  reportPicture(session, arguments, file, picture.width, picture.height, session.lastRenderer());
}

/// Draws the surface of a call and makes it the session's picture. `file` is the file for which it is drawn, or "".
void drawSurfaceFor(Session& session, const Arguments& arguments, const std::string& file) {
  const auto settings = [](const Arguments& given, const Box& box) { return surfacePicture(given, box); };
  const render::SurfacePicture picture = drawForSession(session, arguments, file, settings, render::drawSurface);
  noteOddSurface(session.console(), session.current().field, picture, session.picture().seen);
}

render::Image renderedImage(Session& session, const Arguments& arguments) {
  drawSurfaceFor(session, arguments, "");
  return session.picture().image;
}

void runRender(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  requirePicture(file);
  surfacePicture(arguments);  // throws `Error` before any work, as `backend` does
  backend(arguments);
  checkWritable(file);
  drawSurfaceFor(session, arguments, file);
  const render::Image& image = session.picture().image;
  savePicture(image, session.picture().vectors, file);
  reportPicture(session, arguments, file, image.width, image.height, session.lastRenderer());
}

using render::ColorBy;

const std::vector<Parameter> kSlicePlane = {
    {"axis", choice({"x", "y", "z"}).byDefault("z"), "Axis to which the plane is perpendicular."},
    {"offset", number().in("world units"),
     "Coordinate at which the plane crosses that axis. When left out, the middle of the surface's box."},
    {"plane", numbers("PX,PY,PZ,NX,NY,NZ", {6}).in("world units"),
     "Point and normal of the plane, instead of axis and offset."},
    {"zoom", number().above(0).byDefault("1"), "Magnification; 1 shows the whole section."},
    {"target", numbers("X,Y,Z", {3}).in("world units"),
     "Point in the middle of the picture, projected onto the plane; the section's middle when left out."}};

std::vector<Parameter> renderCamera() {
  return {{"camera", numbers("AZIMUTH,ELEVATION,DISTANCE", {3}).byDefault("30,20,1.1"),
           "Azimuth and elevation in degrees, and the distance of the eye from the centre in diagonals of the domain."},
          {"target", numbers("X,Y,Z", {3}).in("world units"),
           "Point in the middle of the picture, around which the camera turns; the domain's centre when left out. A "
           "small distance in camera shows it from nearby."},
          {"up", choice({"y", "z"}).byDefault("y").advanced(), "Axis that points up in the picture."},
          {"projection", choice({"perspective", "orthographic"}).byDefault("perspective").advanced(),
           "orthographic uses parallel rays, so that lengths can be compared anywhere in the picture; at the target "
           "its scale is that of perspective."},
          {"view", choice(viewNames()),
           "Named direction instead of camera: front faces -z (with z up: y), right faces -x, corner follows a "
           "diagonal of the cube."}};
}

const std::vector<Parameter> kRenderDrawn = {
    {"offset", number().in("world units").byDefault("0"), "Distance whose level set is drawn."},
    {"clip", choice({"x", "y", "z"}),
     "Cuts the body across this axis. The half towards the camera is left out, and the section shows the cells in the "
     "colours of the picture."},
    {"clip-offset", number().in("world units"),
     "Coordinate at which the cut crosses that axis. When left out, the middle of the surface's box."},
    {"cracks", flag().advanced(),
     "Marks cracks in violet: pixels in which the field jumps across the drawn distance from one cell to the next. "
     "The caption names the widest jump."},
    {"defects", text("MESH|own").advanced(),
     "Marks the defects of this mesh as 'mesh --picture' does. own is the mesh from which the field was made, where "
     "that is known."},
    {"shadows", flag("true").advanced(),
     "Measures by the field how much light reaches the surface: folds are darker, and the solid throws a soft shadow. "
     "--shadows=false draws about twice as fast."},
    {"edges", flag(), "Draws lines where the surface bends by more than 30 degrees, and along its outlines."},
    {"surface", flag("true").advanced(), "Draws the surface. --surface=false shows planes and cells alone."},
    {"plane", numbers("x|y|z|PX,PY,PZ,NX,NY,NZ", {6}).orWords({"x", "y", "z"}).in("world units"),
     "Also draws a section of the domain in the colours of the picture, with outlined cells and the surface as a line: "
     "across an axis, or through a point with a normal."},
    {"plane-offset", number().in("world units").advanced(),
     "Coordinate at which such a plane crosses its axis. When left out, the middle of the surface's box."},
    {"cells", choice({"none", "lines", "boxes"}).byDefault("none"),
     "Also draws the cells of the octree: lines along their edges, faded where cells are small in the picture, or "
     "boxes of 0.8 of their extent in the colours of the picture."},
    {"at-surface", flag(), "Draws only cells that the surface crosses."},
    {"degrees", text("LIST").advanced(),
     "Draws cells of these polynomial degrees only: numbers, ranges and the word exact, as in 2,4-6,exact."},
    {"depths", text("LIST").advanced(), "Draws cells of these depths only: numbers and ranges, as in 2,4-6."}};

/// Returns the parameters that choose the colours of a picture. The parameter `color` accepts all colour modes
/// (`ColorBy`) except `left`. Its help text begins with the text `ofCells`.
std::vector<Parameter> colorParameters(ColorBy left, const std::string& ofCells, const std::string& standard) {
  return {
      {"color", choice(colorNames(left)).byDefault(standard), ofCells + " " + quantityHelp()},
      {"range", numbers("LOW,HIGH", {2}),
       "Values of the darkest and the lightest colour of a jump, slope or error, or distances between which "
       "colours and iso-lines are chosen. Use it to compare pictures; when left out, it is chosen from the values."},
      {"per-cell", flag(),
       "Colours each cell by the greatest value that the picture shows of it, in place of each point by its own. Cells "
       "that are worse than others are then seen at once."},
      {"scale", choice({"log", "linear"}).byDefault("log").advanced(), "Scale of the colours between these values."},
      {"map", choice(mapNames()).advanced(),
       "Colours of a jump, slope or error, or of the distance: 'hpsdf help colors' shows these maps and which is for "
       "what. Degrees and depths have colours of their own, the same in every picture."},
      {"mesh", text("MESH"),
       "The surface from which the field was made, for --color error. It is known already for built-in and "
       "analytic shapes, and for a mesh that was built in the same script."},
      {"other", file("FIELD"), "The field to compare with, for --color difference."}};
}

const std::vector<Parameter> kSizeSamplesArrows = {
    {"size", size(16, 16384).byDefault("1280x720").under(kPicture),
     "Size of the whole picture, with legend and caption."},
    {"samples", wholeNumber().within(1, 8).byDefault("1").under(kPicture),
     "Number of samples a pixel along each axis. Use 4 for smooth pictures to print; the time grows with its square."},
    {"arrows", wholeNumber().within(0, 1000).in("pixels").byDefault("0").under(kDrawn).advanced(),
     "Distance between arrows that show the gradient, at least 4; 0 draws none. An arrow is 0.8 of that long where the "
     "gradient has length 1 and lies in the plane of the picture."}};

const std::vector<Parameter> kSliceDrawn = {
    {"operands", text("EXPRESSION|own"),
     "Draws the outlines of the operands of an expression, each in a colour of its own: solid where the field's "
     "surface follows them, dashed elsewhere. The word own stands for the expression from which 'combine' built the "
     "field. Its files are read again, by their names, from the folder of the field or the current one: if these have "
     "changed, or lie in several folders, give the expression with their paths."}};

void checkSlice(const Arguments& arguments) {
  if (arguments.given("operands")) checkOperands(arguments.text("operands"));
}

Command sliceCommand() {
  return {
      .name = "slice",
      .summary = "Draw a plane through a field, coloured by degree, depth, distance, jumps or errors.",
      .help = paragraphs(R"(
The plane is perpendicular to an axis, or given by a point and a normal. Colours by degree and depth show the cells with
their outlines; colours by distance show iso-lines and the surface as a heavy line.

The extension of the output decides what is written: .png is a picture with legend and caption. .svg and .pdf hold the
same picture for papers, as lines, areas and text; colours that vary within cells are pixels in them. .csv (columns
x,y,z,value,degree,depth, one row for each pixel in the domain) and .pfm (32-bit floats, NaN outside the domain) hold
raw values of as many pixels as size says: distances, or in a .pfm the quantity that color names. The degree of an exact
cell is the word exact in a .csv and the number 31 in a .pfm.)"),
      .examples = {"hpsdf slice bunny.hpsdf -o degree.png",
                   "hpsdf slice bunny.hpsdf -o distance.png --axis x --offset 0.2 --color distance",
                   "hpsdf slice bunny.hpsdf -o oblique.png --plane 0,0,0,1,1,0 --color depth",
                   "hpsdf slice bunny.hpsdf -o error.png --color error --mesh bunny.obj --range 1e-6,1e-3",
                   "hpsdf slice bunny.hpsdf -o figure.pdf --size 640x400",
                   "hpsdf slice twins.hpsdf -o operands.png --color distance --operands own",
                   "hpsdf slice bunny.hpsdf -o values.csv --size 64x64"},
      .parameters =
          joined({{fieldParameter(),
                   {"output", outputFile().as('o').required(), "File to write: *.png, *.svg, *.pdf, *.pfm or *.csv."}},
                  under("Plane", kSlicePlane),
                  under(kDrawn, kSliceDrawn),
                  under(kColours, colorParameters(ColorBy::normal,
                                                  "degree and depth show the cells, distance iso-lines.", "degree")),
                  kSizeSamplesArrows,
                  formParameters(),
                  backendParameters()}),
      .action = runSlice,
      .draw = slicedImage,
      .view =
          [](Session& session, const Arguments& arguments) {
            return viewScript(slicePicture(arguments, shownBox(session.current().field)));
          },
      .check = checkSlice,
  };
}

Command renderCommand() {
  return {
      .name = "render",
      .summary = "Draw the surface of a field by sphere tracing.",
      .help =
          "The surface is where the distance is 0, or equals an offset: positive offsets thicken the body, negative "
          "ones make it thinner. The camera turns around the centre of the domain. Planes, cells and arrows can be "
          "drawn with the surface or without it. In a .svg or .pdf the legend and the caption are shapes and text, the "
          "view is made of pixels.",
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
      .parameters = joined(
          {{fieldParameter(), {"output", outputFile().as('o').required(), "File to write: *.png, *.svg or *.pdf."}},
           under(kCamera, renderCamera()),
           under(kDrawn, kRenderDrawn),
           under(kColours,
                 colorParameters(ColorBy::distance,
                                 "normal lights the surface; degree and depth show the cells that hold it.", "normal")),
           kSizeSamplesArrows,
           formParameters(),
           backendParameters()}),
      .action = runRender,
      .draw = renderedImage,
      .view =
          [](Session& session, const Arguments& arguments) {
            return viewScript(surfacePicture(arguments, shownBox(session.current().field)));
          },
  };
}

}  // namespace

void addPictureCommands(Registry& registry) {
  registry.add(sliceCommand());
  registry.add(renderCommand());
}

}  // namespace hpsdf::app
