#include <fmt/format.h>

#include "commands/commands.h"
#include "commands/made_field.h"
#include "construction/build_arguments.h"
#include "construction/build_field.h"
#include "hpsdf/combine/expression.h"
#include "session/session.h"

namespace hpsdf::app {
namespace {

/// Finds mistakes in the expression before anything runs.
void checkCombine(const Arguments& arguments) {
  parseExpression(arguments.text("expression"));
  checkCheckpoint(arguments);
}

void runCombine(Session& session, const Arguments& arguments) {
  const std::string expression = arguments.text("expression");
  buildAndReport(session, arguments, {.name = expression}, [&](const std::filesystem::path& checkpoint) {
    return buildField(session.console(), combinedInput(session.console(), expression, arguments), "expression",
                      arguments, checkpoint);
  });
}

/// Returns a paragraph for each operation.
std::string operationsHelp() {
  std::string text;
  for (const OperationDescription& row : operations()) text += fmt::format("{} is {}.\n\n", row.form, row.help);
  return text;
}

std::string combineHelp() {
  return paragraphs(R"(
Builds one field of an expression of solids, such as 'difference(offset(a.hpsdf, 0.02), move(b.obj, 0, 0, 1))'. A, B, … stand
for solids: a field, a mesh file, a grid (.vdb, .vti), builtin:SHAPE, analytic:SHAPE or an expression. Quote the whole
expression for the shell. A name that holds blanks, commas, parentheses or quotes, or looks like a number, is written between
quotes of its own: " or '. If the name contains that quote, write it twice. Lengths are in the units of the solids; a field counts in its own. The operations are:)") +
         "\n\n" + operationsHelp() + paragraphs(R"(
A Boolean expression of closed meshes is exact everywhere: the triangles are cut where others cross them, and distances are
measured to the pieces that bound the result. Inside a union, the distance is therefore that to the outer surface. With a
field, a grid, an open mesh, an offset, a shell or a smooth operation, some values are lower bounds instead: no value is
farther from 0 than the surface is. A line of the report says which of them are exact, and 'hpsdf info' shows it later.

All other options are those of 'hpsdf build', with their meaning: the field approximates the distance of the expression
within the tolerance or target error that is given here. Cutting two meshes of 70,000 triangles takes about
two seconds. Sharp creases of the result take more bytes than smooth surfaces, because no leaf of the field is exact.

'hpsdf slice --operands own' shows where the operands of a field lie, and which parts of their surfaces bound the result.)");
}

const std::vector<Parameter> kCombineParameters = {
    {"expression", text("EXPRESSION").positional().required(),
     "Operations on solids, such as 'union(a.obj, scale(b.hpsdf, 2))'."}};

}  // namespace

void addCombineCommand(Registry& registry) {
  registry.add({
      .name = "combine",
      .summary = "Build a field of several solids: their union, difference, offset, shell.",
      .help = combineHelp(),
      .examples = {"hpsdf combine 'union(a.obj, move(a.obj, 0.5, 0, 0))' -o twins.hpsdf --tolerance 0.1%",
                   "hpsdf combine 'difference(offset(a.hpsdf, 0.02), move(b.obj, 0, 0, 1))' -o c.hpsdf",
                   "hpsdf combine 'shell(builtin:torus,minor=0.2, 0.05, inward)' -o hollow.hpsdf",
                   "hpsdf combine 'smooth-union(a.hpsdf, rotate(b.hpsdf, 0, 0, 1, 90), 0.1)' -o soft.hpsdf"},
      .parameters = joined({kCombineParameters,
                            {fieldOutputParameter(), compressParameter()},
                            checkpointParameters(),
                            buildParameters()}),
      .action = runCombine,
      .check = checkCombine,
  });
}

}  // namespace hpsdf::app
