#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>

#include "commands/commands.h"
#include "hpsdf/detail/line.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/render/line_plot.h"
#include "pictures/picture_arguments.h"
#include "session/field_argument.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

using namespace std::string_view_literals;

bool isPicture(const std::string& file) {
  const std::string kind = lowerExtension(file);
  if (kind == ".pdf") render::requirePdf();
  if (kind != ".png" && kind != ".csv" && !render::isVectorFile(file))
    throw Error(
        fmt::format("{}: unknown kind of output '{}'; expected .png, .svg or .pdf for a plot, or .csv for the samples",
                    file, kind));
  return kind != ".csv";
}

std::size_t cellCount(const Line& line) {
  return static_cast<std::size_t>(
      std::ranges::count_if(line.pieces, [](const Piece& piece) { return piece.cell.has_value(); }));
}

Line lineOf(const Field& field, const Arguments& arguments) {
  const Vector3 from = pointOf(arguments, "from"), to = pointOf(arguments, "to");
  if (from == to) throw Error(fmt::format("from and to are both {}: give two points", vectorText(from)));
  Line line = sampleLine(field, from, to, arguments.whole("samples"));
  if (cellCount(line) == 0)
    throw Error(fmt::format("the line from {} to {} does not meet the field's domain, {}: give other points",
                            vectorText(from), vectorText(to), boxText(field.domain())));
  return line;
}

/// Returns the exact distances at the samples of the line. Returns an empty vector if the exact distance is
/// unknown.
std::vector<double> exactValues(Session& session, const Arguments& arguments, const Line& line) {
  const std::string mesh = arguments.textOr("mesh", "");
  if (mesh.empty() && !session.knowsExact()) return {};
  std::vector<Vector3> points;
  for (const LineSample& sample : line.samples) points.push_back(sample.point);
  std::vector<double> values(points.size());
  session.exact(mesh)(points, values);
  return values;
}

/// Writes a CSV file with one row for each sample of the line. The column of a value that is unknown stays
/// empty.
void writeTable(const Line& line, std::span<const double> exact, const std::string& file) {
  OutputFile out(file);
  out.write("t,s,x,y,z,cell,degree,depth,value,exact,error,gx,gy,gz,slope_along\n");
  for (std::size_t i = 0; i < line.samples.size(); ++i) {
    const LineSample& sample = line.samples[i];
    const auto& cell = line.pieces[sample.piece].cell;
    const Vector3 &x = sample.point, &g = sample.gradient;
    out.write(fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", sample.t, sample.t * line.length(), x.x(), x.y(),
                          x.z(), cell ? fmt::format("{},{},{}", cell->id, levelName(cell->degree), cell->depth) : ",,",
                          sample.value, exact.empty() ? "," : fmt::format("{},{}", exact[i], sample.value - exact[i]),
                          g.x(), g.y(), g.z(), line.slopeAlong(sample)));
  }
  out.commit();
}

LineJump greatestJump(const Line& line) {
  LineJump greatest{0, 0};
  for (const LineJump& jump : jumpsAlong(line))
    if (std::abs(jump.value) > std::abs(greatest.value)) greatest = jump;
  return greatest;
}

double greatestError(const Line& line, std::span<const double> exact) {
  double greatest = 0;
  for (std::size_t i = 0; i < exact.size(); ++i)
    greatest = std::max(greatest, std::abs(line.samples[i].value - exact[i]));
  return greatest;
}

void report(Session& session, const Arguments& arguments, const Line& line, std::span<const double> exact) {
  const std::string file = arguments.text("output");
  const LineJump jump = greatestJump(line);
  const std::size_t cells = cellCount(line);
  if (session.wantsJson(arguments)) {
    Json json = {{"output", file},
                 {"length", line.length()},
                 {"samples", line.samples.size()},
                 {"cells", cells},
                 {"greatest_jump", {{"value", jump.value}, {"t", jump.t}}}};
    if (!exact.empty()) json["greatest_error"] = greatestError(line, exact);
    return printJson(session.console().out, json);
  }
  std::string text =
      fmt::format("{}: {} samples, {}", file, grouped(line.samples.size()), countOf(cells, "cell", "cells"));
  if (jump.value != 0)
    text += fmt::format(", greatest jump {} at t = {:.4g}", shortNumber(std::abs(jump.value)), jump.t);
  if (!exact.empty()) text += fmt::format(", greatest error {}", shortNumber(greatestError(line, exact)));
  session.console().out << text << "\n";
}

/// Draws the plot of a line for the file `file`, or for no file if this is "".
render::DrawnLine drawnLine(const Field& field, const Line& line, std::span<const double> exact,
                            const Arguments& arguments, const std::string& file) {
  const auto [width, height] = arguments.size("size");
  render::PictureForm form = pictureForm(arguments);
  form.vectors = render::isVectorFile(file);
  return render::drawLine(field, line, exact, width, height, form);
}

render::Image drawProbe(Session& session, const Arguments& arguments) {
  useField(session, arguments);
  const Field& field = session.current().field;
  const Line line = lineOf(field, arguments);
  return drawnLine(field, line, exactValues(session, arguments, line), arguments, "").image;
}

void runProbe(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  const bool picture = isPicture(file);
  for (const char* name : {"size", "dpi", "transparent"})
    if (!picture && arguments.given(name))
      throw Error(fmt::format("{}: only a plot has {}; leave it out", file, name == "size"sv ? "a size" : name));
  checkWritable(file);
  useField(session, arguments);
  const Field& field = session.current().field;
  const Line line = lineOf(field, arguments);
  const std::vector<double> exact = exactValues(session, arguments, line);
  if (picture) {
    const render::DrawnLine drawn = drawnLine(field, line, exact, arguments, file);
    savePicture(drawn.image, drawn.vectors, file);
  } else {
    writeTable(line, exact, file);
  }
  report(session, arguments, line, exact);
}

const std::vector<Parameter> kProbeParameters = {
    {"from", numbers("X,Y,Z", {3}).in("world units").required().under("The line"), "Start of the line."},
    {"to", numbers("X,Y,Z", {3}).in("world units").required().under("The line"), "End of the line."},
    {"output", outputFile().as('o').required(),
     "File to write: *.png, *.svg or *.pdf for a plot, *.csv for the samples."},
    {"samples", wholeNumber().within(2, 1000000).byDefault("1000").under("The line"),
     "Number of evenly spaced samples, both ends included. Each border of cells adds two."},
    {"mesh", text("MESH"),
     "The surface from which the field was made. It gives the exact distance; without it there are no errors. It is "
     "known already for built-in and analytic shapes, and for a mesh that was built in the same script."},
    {"size", size(16, 16384).byDefault("1280x720").under(kPicture), "Size of the plot."}};

}  // namespace

void addProbeCommand(Registry& registry) {
  registry.add({
      .name = "probe",
      .summary = "Sample a field along a line: distance, error, gradient, cells.",
      .help = paragraphs(R"(
Evaluates the field at points of a line and draws or writes what it finds. Use it to see jumps between cells and errors
in detail.

A .png, .svg or .pdf shows curves over the distance along the line: f and the exact distance; the error f − exact on its own scale,
or, where the exact distance is unknown, the jumps of f at borders of cells; the length of the gradient and its
component along the line; bands of the cells' degrees and depths. Thin lines mark borders of cells. Each leaf's
polynomial is drawn up to both of its ends, so that a jump is a vertical step.

A .csv has one row for each sample: the parameter t from 0 to 1, the distance s along the line, the point, its cell,
degree and depth, f, the exact distance, the error, the gradient, and its component along the line. At a border of two
cells two rows with the same t hold the limits from both sides. Outside the domain, f is the continuation of the field
and the columns of the cell are empty. The columns of the exact distance are empty where it is unknown.)"),
      .examples = {"hpsdf probe bunny.hpsdf --from -1,0,0 --to 1,0,0 -o line.png --mesh bunny.obj",
                   "hpsdf probe bunny.hpsdf --from 0.2,0.3,0 --to 0.2,0.4,0 -o line.csv --samples 100",
                   "hpsdf probe torus.hpsdf --from 0,0,0 --to 1,1,1 -o line.png --size 960x720"},
      .parameters = joined({{fieldParameter()}, kProbeParameters, formParameters()}),
      .action = runProbe,
      .draw = drawProbe,
  });
}

}  // namespace hpsdf::app
