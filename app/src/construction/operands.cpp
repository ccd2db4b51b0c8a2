#include "construction/operands.h"

#include <algorithm>
#include <memory>
#include <variant>

#include "construction/file_kind.h"
#include "construction/surface.h"
#include "hpsdf/field_file.h"
#include "hpsdf/shapes.h"

namespace hpsdf::app {

Expression withLoadedOperands(const Console& console, const Expression& expression, InsideTest insideTest) {
  return withOperands(expression, [&](const std::string& name) -> Expression {
    if (name.starts_with(kAnalytic)) return shapes::analytic(name);
    if (!isShape(name) && kindOfFile(name) == FileKind::field) return load(name);
    TriangleMesh mesh = importSurface(console, name).mesh;
    requireDistanceMemory(mesh, insideTest);
    return mesh;
  });
}

bool hasField(const Expression& expression) {
  const Expression::Node& node = expression.node();
  if (std::holds_alternative<std::shared_ptr<const Field>>(node.operand)) return true;
  return std::ranges::any_of(node.operands, hasField);
}

}  // namespace hpsdf::app
