#include "construction/operands.h"

#include <algorithm>
#include <utility>

#include "construction/file_kind.h"
#include "construction/grid_surface.h"
#include "construction/surface.h"
#include "hpsdf/error.h"
#include "hpsdf/field_file.h"
#include "hpsdf/shapes.h"

namespace hpsdf::app {
namespace {

void refuseProof(const std::string& proof, const std::string& name, const char* reason) {
  if (!proof.empty())
    throw Error(ErrorKind::option, name, reason + (": leave out " + proof) + ", or take another operand");
}

Expression loadedMesh(const Console& console, const std::string& name, InsideTest insideTest,
                      const std::string& proof) {
  ImportedMesh imported = importSurface(console, name);
  if (!imported.report.closed()) refuseProof(proof, name, "the mesh has holes, beside which nothing is proven");
  requireDistanceMemory(imported.mesh, insideTest);
  return std::move(imported.mesh);
}

bool isBoolean(Operation operation) { return operation != Operation::operand && descriptionOf(operation).takesMany; }

bool isTransform(Operation operation) {
  return operation == Operation::move || operation == Operation::rotate || operation == Operation::scale;
}

bool hasBoolean(const Expression& expression) {
  const Expression::Node& node = expression.node();
  return isBoolean(node.operation) || std::ranges::any_of(node.operands, hasBoolean);
}

/// Returns a grid as an operand. What is interpolated between samples is no exact distance.
Expression loadedGrid(const Console& console, const std::string& name) {
  if (!tellsWherePointsLie(name))
    throw Error(
        ErrorKind::file, name,
        "an array of NumPy does not tell where its points lie: make a field of it by 'hpsdf build --spacing', and "
        "combine that");
  GridDistance grid = readGridSurface(console, name, {});
  const Box domain = grid.domain();
  Source source = grid.source();
  source.exactness = Exactness::nowhere;
  return Expression::within(domain, DistanceFunction(std::move(grid), std::move(source)));
}

}  // namespace

std::vector<Expression> booleanOperands(const Expression& expression) {
  const Expression::Node& node = expression.node();
  if (node.operation == Operation::operand) return {expression};
  std::vector<Expression> operands;
  for (const Expression& part : node.operands) {
    if (isBoolean(node.operation) && !hasBoolean(part)) {
      operands.push_back(part);
      continue;
    }
    for (const Expression& operand : booleanOperands(part))
      operands.push_back(isTransform(node.operation) ? Expression::operation(node.operation, {operand}, node.numbers)
                                                     : operand);
  }
  return operands;
}

Expression withLoadedOperands(const Console& console, const Expression& expression, InsideTest insideTest,
                              const std::string& proof) {
  return withOperands(expression, [&](const std::string& name) -> Expression {
    if (name.starts_with(kAnalytic)) return shapes::analytic(name);
    const bool isField = !isShape(name) && kindOfFile(name) == FileKind::field;
    if (!isField && isGridName(name)) {
      refuseProof(proof, name, "nothing is proven of a grid, between whose samples distances are interpolated");
      return loadedGrid(console, name);
    }
    if (!isField) return loadedMesh(console, name, insideTest, proof);
    refuseProof(proof, name, "nothing is proven of a field, which has errors of its own");
    return load(name);
  });
}

}  // namespace hpsdf::app
