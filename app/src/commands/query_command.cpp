#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "commands/commands.h"
#include "commands/point_query.h"
#include "construction/file_kind.h"
#include "construction/reference_surface.h"
#include "files/text_file.h"
#include "hpsdf/detail/output_file.h"
#include "session/field_argument.h"
#include "session/session.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Returns true for a text that is meant as a point X,Y,Z or a box. It may still be none, such as 1,2.
bool looksLikePoint(const std::string& text) {
  return text.find(',') != std::string::npos && text.front() != 'e' && text.front() != 'E' &&
         text.find_first_not_of("0123456789+-.eE,") == std::string::npos;
}

/// Opens the points or boxes of a query: a single one, such as X,Y,Z, a file, or the given stream if the name is "-". A
/// file whose name looks like a point is read as a file. `what` tells what the file should hold.
class PointSource {
 public:
  PointSource(const std::string& points, const char* what, std::istream& in) : name_(points) {
    if (points == "-") {
      name_ = "stdin";
      in_ = &in;
    } else if (std::error_code unknown; looksLikePoint(points) && !std::filesystem::exists(points, unknown)) {
      point_.str(points);
      in_ = &point_;
    } else {
      file_ = openFile(points, what);
      in_ = &file_;
    }
  }

  std::istream& in() const { return *in_; }
  const std::string& name() const { return name_; }

 private:
  std::string name_;
  std::istringstream point_;
  std::ifstream file_;
  std::istream* in_ = nullptr;
};

/// The words of a query: a field, which a query for closest points need not have, and the points or boxes.
struct QueryWords {
  std::string field, points;
};

/// Returns the words of a query. Where closest points of a mesh are asked for, a single positional word that is no
/// field stands for the points.
QueryWords queryWords(const Arguments& arguments) {
  QueryWords words{arguments.textOr("field", ""), arguments.textOr("points", "")};
  if (arguments.has("closest") && !arguments.named("field") && words.points.empty() && !words.field.empty() &&
      kindOfFile(words.field) != FileKind::field)
    std::swap(words.field, words.points);
  return words;
}

void checkQuery(const Arguments& arguments) {
  if (!arguments.has("boxes")) return;
  if (arguments.has("points")) throw Error("boxes excludes points: give one of them");
  if (arguments.has("closest")) throw Error("boxes excludes closest: give one of them");
}

/// Reads the questions, and passes the answers to the function that it gets. Returns the number of questions.
using Answer = std::function<std::size_t(const std::function<void(std::string_view)>& write)>;

/// Returns the answer to a query for the closest points of a mesh, in the units of the field if the query names one.
Answer closestAnswer(Session& session, const Arguments& arguments, const QueryWords& words, const PointSource& source,
                     PointFormat format) {
  if (!words.field.empty()) loadField(session, words.field);
  const std::optional<Source> of =
      session.hasField() ? std::optional(session.current().field.metadata().source) : std::nullopt;
  const MeshDistance mesh = meshDistance(session.console(), arguments.text("closest"), of);
  return [mesh, &source, format](const auto& write) {
    return queryClosestPoints(*mesh.distance, source.in(), source.name(), format, write);
  };
}

Answer fieldAnswer(Session& session, const QueryWords& words, bool ofBoxes, const PointSource& source,
                   PointFormat format) {
  if (!words.field.empty()) loadField(session, words.field);
  const Field& field = session.current().field;
  return [&field, &source, format, ofBoxes](const auto& write) {
    return (ofBoxes ? queryBoxes : queryPoints)(field, source.in(), source.name(), format, write);
  };
}

void runQuery(Session& session, const Arguments& arguments) {
  const bool ofBoxes = arguments.has("boxes"), ofMesh = arguments.has("closest");
  const QueryWords words = queryWords(arguments);
  if (words.field.empty() && !ofMesh && !session.hasField())
    throw Error("query: field is missing; 'hpsdf help query' explains");
  const PointFormat format = session.wantsJson(arguments) ? PointFormat::json : PointFormat::csv;
  const PointSource source =
      ofBoxes ? PointSource(arguments.text("boxes"), "a file of boxes", session.console().in)
              : PointSource(words.points.empty() ? "-" : words.points, "a file of points", session.console().in);
  const Answer answer = ofMesh ? closestAnswer(session, arguments, words, source, format)
                               : fieldAnswer(session, words, ofBoxes, source, format);
  std::optional<OutputFile> output;
  if (arguments.has("output")) output.emplace(arguments.text("output"));
  const std::size_t count = answer([&](std::string_view text) {
    if (output) return output->write(text);
    std::ostream& out = session.console().out;
    out << text << std::flush;
    requireWritten(out);
  });
  if (!output) return;
  output->commit();
  session.console().err << fmt::format("{}: {}\n", printable(arguments.text("output")),
                                       ofBoxes ? countOf(count, "box", "boxes") : countOf(count, "point", "points"));
}

Parameter queriedField() {
  Parameter parameter = fieldParameter();
  parameter.need = Need::optional;
  parameter.help += " With closest it may be left out, too.";
  return parameter;
}

}  // namespace

void addQueryCommand(Registry& registry) {
  registry.add({
      .name = "query",
      .summary = "Compute distances and gradients at points, ranges over boxes, or closest points of a mesh.",
      .help = paragraphs(R"(
Takes one point, or reads points from a file or standard input, one a line as x,y,z or x y z; empty lines, # comments
and a header line are ignored. In a script that leaves FIELD out, a point is given as points=X,Y,Z. Writes CSV with the
header x,y,z,distance,gx,gy,gz and numbers in full precision, or with --json an array of objects.

Distances are negative inside. Outside the domain the field is continued continuously.

--boxes asks for ranges instead: the interval from min to max contains every value of the field in the box, rounding
included. Where min is above 0, the whole box is outside; where max is below 0, it is inside. For boxes of an eighth of
the domain's edge, the interval is typically 20 % wider than necessary, and up to twice as wide where cells are exact or
blended. A box takes about a microsecond; the preparations before grow with the field. If the field has bounds ('build --bounds'), exact_min and exact_max contain the exact distance
too.

--closest asks a mesh instead of a field: for each point, the exact signed distance, the closest point px,py,pz of the
mesh's triangles, and where it lies. face is the number of the triangle, from 0, in the mesh as it is after its
clean-up. feature is face, edge or vertex: the edge number k runs from the triangle's corner k to the next one, k is 0 to
2, and a vertex has its corner's number. b0,b1,b2 are the barycentric coordinates: the weights with which the triangle's
corners sum to the closest point. winding is the generalised winding number: the number of times the mesh surrounds the point. Together
with FIELD, the mesh is taken in the units and with the inside test of the field.)"),
      .examples = {"hpsdf query bunny.hpsdf 0.1,0.2,0.3", "echo 0.1 0.2 0.3 | hpsdf query bunny.hpsdf",
                   "hpsdf query bunny.hpsdf points.csv -o distances.csv",
                   "hpsdf query bunny.hpsdf --boxes 0,0,0,0.1,0.1,0.2",
                   "hpsdf query --closest bunny.obj points.csv -o closest.csv"},
      .parameters = {queriedField(),
                     {"points", file("POINTS").positional(),
                      "A point X,Y,Z, or a file of points; - or nothing for standard input."},
                     {"boxes", file("BOXES"),
                      "Write certified ranges of the field over boxes: a box X0,Y0,Z0,X1,Y1,Z1, or a file with a box a "
                      "line, the lower corner first; - for standard input. Excludes POINTS."},
                     {"closest", file("MESH"),
                      "Write the closest points of a mesh, a file or builtin:SHAPE, with face, feature, barycentric "
                      "coordinates and winding number. Excludes boxes."},
                     {"output", outputFile().as('o'), "File to write; standard output when left out."}},
      .action = runQuery,
      .check = checkQuery,
  });
}

}  // namespace hpsdf::app
