#include "session/field_operands.h"

#include <filesystem>
#include <memory>
#include <utility>

#include "console/long_work.h"
#include "construction/operands.h"
#include "construction/surface.h"
#include "hpsdf/combine/combined_distance.h"
#include "hpsdf/error.h"

namespace hpsdf::app {
namespace {

/// Returns the path of a file that a field names, in the folder of the field's file or else as it is.
std::string fileBeside(const CurrentField& current, const std::string& name) {
  const std::filesystem::path beside = std::filesystem::path(current.name).parent_path() / name;
  std::error_code ignored;
  return !isShape(name) && std::filesystem::is_regular_file(beside, ignored) ? beside.string() : name;
}

/// Returns the expression from which the field was built, with the paths of its files.
Expression ownExpression(const CurrentField& current) {
  const Source& source = current.field.metadata().source;
  if (!source.exactness)
    throw Error("operands: the field was not built by 'combine'; give an expression, such as 'union(a.obj, b.obj)'");
  return withOperands(parseExpression(source.name),
                      [&](const std::string& name) { return Expression::named(fileBeside(current, name)); });
}

Expression inUnitsOf(const Source& source, Expression expression) {
  const auto& [center, scale] = source.normalization;
  if (source.normalization.isIdentity()) return expression;
  return combine::scaled(combine::moved(std::move(expression), -center), scale);
}

/// Throws `Error` if the files that a field names are not those from which it was made.
void refuseOtherFiles(const Source& source, const Expression& loaded) {
  if (source.fingerprint == 0 || fingerprint(loaded) == source.fingerprint) return;
  throw Error(
      "operands: the files of these names are others than those from which the field was made; give the "
      "expression with their paths: '" +
      source.name + "'");
}

}  // namespace

std::vector<render::OutlinedSolid> loadedOperands(const Console& console, const CurrentField& current,
                                                  const std::string& expression) {
  const Source& source = current.field.metadata().source;
  const DistanceOptions options{.insideTest = source.insideTest};
  const Expression loaded = withLoadedOperands(
      console, expression == kOwnOperands ? ownExpression(current) : parseExpression(expression), options.insideTest);
  if (expression == kOwnOperands) refuseOtherFiles(source, loaded);
  std::vector<render::OutlinedSolid> solids;
  for (const Expression& operand : booleanOperands(loaded)) {
    DistanceFunction distance = withProgress(console, [&](const Progress& progress) -> DistanceFunction {
      return CombinedDistance(inUnitsOf(source, operand), options, progress);
    });
    solids.push_back({textOf(operand), std::make_shared<const DistanceFunction>(std::move(distance))});
  }
  return solids;
}

void checkOperands(const std::string& expression) {
  if (expression != kOwnOperands) parseExpression(expression);
}

}  // namespace hpsdf::app
