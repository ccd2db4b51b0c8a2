#include "commands/commands.h"
#include "pictures/picture_arguments.h"
#include "session/field_argument.h"
#include "session/field_surface.h"
#include "session/why_report.h"

namespace hpsdf::app {
namespace {

void runWhy(Session& session, const Arguments& arguments) {
  useField(session, arguments);
  const WhyReport report = whyAt(session, arguments.textOr("mesh", ""), pointOf(arguments, "point"));
  session.setExplanation(Session::Explanation{report.point, whyLines(report)});
  if (session.wantsJson(arguments)) return printJson(session.console().out, whyJson(report));
  session.console().out << whyText(report);
}

}  // namespace

void addWhyCommand(Registry& registry) {
  registry.add({
      .name = "why",
      .summary = "Explain why a field is as it is at a point: the history of its cell.",
      .help = paragraphs(R"(
Repeats the construction for the one cell that holds the point, and prints each decision about it. The file of the field
does not grow: the decisions about a cell do not depend on other cells, so that they can be taken again from the mesh.

Each row of the table is one decision. For a field with a target error τ it has the depth and the degree of the cell at
that time; the RMS error as the construction estimated it, as measured at 1000 random points of the cell, and the
greatest error there; the reduction of the weighted error per byte that one degree more and eight children were found
to give (μ and ν of the paper), of which the greater one was taken, unless one degree more suffices for --max-error; and
the number of triangles if the cell could become exact ("too many" where a list would be too long).

For a field within a tolerance each row has the edge of the cell; the polynomial of the lowest degree that is within the
tolerance, or else the closest one, with its greatest error over the allowed one and its bytes (it is rejected above
0.93, because errors between the checked points may be greater, and "no proof" stands where only the proof for
--certified failed); the list of triangles with its bytes; and the bytes of eight children with all their descendants, of which the fewest were taken. Where the
search among the children was given up because they already took more, their bytes are a lower bound (≥).

It also names the nearest triangle and whether its face, edge or vertex is nearest, and how the sign was found, with
the winding number about the point. Triangles count from 0, after faces with more corners were divided into triangles
and degenerate ones were removed; of a hull, they and the winding number are those of the hull.

The mesh is needed; it is found by itself if it lies beside the field or in the current folder under its name. In the
explorer, a click on the picture explains the cell there. In scripts, 'why point=X,Y,Z' works on the current field, and
'expect why(x,y,z).NAME' checks the figures of --json.)"),
      .examples = {"hpsdf why part.hpsdf 0.1,0.2,0.3", "hpsdf why bunny.hpsdf 0,0,0 --mesh bunny.obj --json",
                   "hpsdf why torus.hpsdf 0.7,0,0.1"},
      .parameters = {fieldParameter(),
                     {"point", numbers("X,Y,Z", {3}).in("world units").positional().required(),
                      "The point, in the domain of the field."},
                     {"mesh", text("MESH"),
                      "The surface from which the field was made: a mesh file, builtin:SHAPE or analytic:SHAPE."}},
      .action = runWhy,
  });
}

}  // namespace hpsdf::app
