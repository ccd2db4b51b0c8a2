#include "construction/reference_surface.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "construction/file_kind.h"
#include "construction/operands.h"
#include "construction/surface.h"
#include "hpsdf/combine/combined_distance.h"
#include "hpsdf/detail/crossings.h"
#include "hpsdf/shapes.h"

namespace hpsdf::app {
namespace {

/// Returns the options (inside test and thickness) with which a field was made from `source`.
DistanceOptions distanceOptions(const Source& source) {
  return {.insideTest = source.insideTest, .thickness = source.thickness};
}

/// Returns the gradient ∇Φ of the distance to an analytic shape, by central differences with a step of one millionth of
/// the shape's size.
Vector3 differenceQuotient(const DistanceFunction& distance, const Vector3& x) {
  const double step = 1e-6 * distance.source().box.sizes().maxCoeff();
  std::array<Vector3, 6> points;
  for (int axis = 0; axis < 3; ++axis) {
    points[2 * axis] = x + step * Vector3::Unit(axis);
    points[2 * axis + 1] = x - step * Vector3::Unit(axis);
  }
  std::array<double, 6> values;
  distance(points, values);
  return Vector3(values[0] - values[1], values[2] - values[3], values[4] - values[5]) / (2 * step);
}

/// Returns the gradient ∇Φ of the exact distance to a mesh, or the zero vector where the gradient is unknown.
Vector3 exactNormal(const ExactDistance& exact, const Vector3& x, double signedDistance) {
  const double least = 1e-9 * exact.source().box.sizes().maxCoeff();  // shorter offsets are mostly rounding error
  const Vector3 offset = x - exact.closestPoint(x).point;
  const double distance = offset.norm(), thickness = exact.source().thickness;
  // Near a hole of the mesh, the signed distance is measured to the patch that closes the hole, not to the closest
  // triangle. The normal of the patch is unknown.
  const bool isBesideHole = std::abs(std::abs(signedDistance + thickness / 2) - distance) > least;
  if (distance < least || isBesideHole) return Vector3::Zero();
  return offset / (thickness == 0 && signedDistance < 0 ? -distance : distance);
}

void warnIfForeign(const Console& console, const std::string& surface, const Source& found, const Source& source) {
  if (!isMadeFrom(found, source))
    warn(console, fmt::format("{} is not what the field was made from ({})", surface,
                              source.name.empty() ? "unknown" : source.name));
}

ReferenceSurface analyticReference(const DistanceFunction& analytic, const std::string& surface) {
  ReferenceSurface reference;
  reference.distance = std::make_shared<const DistanceFunction>(analytic);
  reference.mesh = shapes::mesh(surface.substr(kAnalytic.size()));
  const Normalization to = analytic.source().normalization;
  for (Vector3& vertex : reference.mesh.vertices) vertex = to.scale * (vertex - to.center);
  reference.normal = [distance = reference.distance](const Vector3& x, double) {
    return differenceQuotient(*distance, x);
  };
  return reference;
}

ReferenceSurface meshReference(const Console& console, PreparedSurface&& prepared, const Source& source) {
  ReferenceSurface reference;
  reference.report = prepared.report;
  const auto exact = distanceTo(console, prepared.mesh, distanceOptions(source));
  reference.distance = withNormalization(exact, prepared.normalization);
  reference.closest = [exact](const Vector3& x) { return exact->closestPoint(x); };
  reference.mesh = source.insideTest == InsideTest::outerHull ? exact->surface() : std::move(prepared.mesh);
  reference.normal = [exact](const Vector3& x, double signedDistance) {
    return exactNormal(*exact, x, signedDistance);
  };
  return reference;
}

/// Returns true for the text of an expression of solids, such as union(a.obj, b.obj).
bool isExpression(const std::string& surface) {
  std::error_code missing;
  const std::string name = surface.substr(0, surface.find('('));
  return name != surface && !std::filesystem::exists(surface, missing) &&
         std::ranges::find(operations(), name, &OperationDescription::name) != operations().end();
}

/// Returns true for an expression, for a field that is the single operand of 'combine', and for the file or shape of a
/// single operand that 'combine' normalized: the fingerprint of its field is that of the mesh before.
bool isCombined(const std::string& surface, const Source& source) {
  const bool isSingle = source.exactness && !source.normalization.isIdentity() && !surface.starts_with(kAnalytic);
  return isExpression(surface) || isSingle || kindOfFile(surface) == FileKind::field;
}

CombinedDistance combinedDistance(const Console& console, const std::string& surface, const Source& source) {
  const Expression expression = isExpression(surface) ? parseExpression(surface) : Expression::named(surface);
  const Expression loaded = withLoadedOperands(console, expression, source.insideTest);
  return withProgress(
      console, [&](const Progress& progress) { return CombinedDistance(loaded, distanceOptions(source), progress); });
}

/// Returns the distance in the units of a field that was made from `source`.
DistanceFunction inUnitsOf(const Source& source, const DistanceFunction& distance) {
  return source.normalization.isIdentity() ? distance : normalizedFunction(distance);
}

ReferenceSurface combinedReference(const Console& console, const std::string& expression, const Source& source) {
  const CombinedDistance combined = combinedDistance(console, expression, source);
  if (combined.boundary() == nullptr) throw Error(std::string(kNeedsTriangles));
  ReferenceSurface reference;
  reference.distance = std::make_shared<const DistanceFunction>(inUnitsOf(source, CombinedDistance(combined)));
  const Normalization to = reference.distance->source().normalization;
  reference.mesh = *combined.boundary();
  for (Vector3& vertex : reference.mesh.vertices) vertex = to.scale * (vertex - to.center);
  reference.normal = [distance = reference.distance](const Vector3& x, double) {
    double value = 0;
    Vector3 gradient;
    distance->withGradients({&x, 1}, {&value, 1}, {&gradient, 1});
    return gradient;
  };
  return reference;
}

}  // namespace

bool isMadeFrom(const Source& candidate, const Source& source) {
  if (source.exactness && source.fingerprint == 0) return candidate.name == source.name;  // an older field of 'combine'
  return candidate.fingerprint == source.fingerprint && (source.fingerprint != 0 || candidate.name == source.name);
}

ReferenceSurface referenceSurface(const Console& console, const std::string& surface, const Source& source) {
  return namingSurface(surface, [&] {
    if (isCombined(surface, source)) {
      ReferenceSurface reference = combinedReference(console, surface, source);
      reference.fieldIsMadeFromIt = isMadeFrom(reference.distance->source(), source);
      return reference;
    }
    if (isGridName(surface))
      throw Error("a grid has no mesh, at which fields are measured; give the mesh from which the grid was made");
    PreparedSurface prepared = prepareSurface(console, surface, !source.normalization.isIdentity());
    ReferenceSurface reference = prepared.function ? analyticReference(*prepared.function, surface)
                                                   : meshReference(console, std::move(prepared), source);
    reference.fieldIsMadeFromIt = isMadeFrom(reference.distance->source(), source);
    return reference;
  });
}

std::shared_ptr<const DistanceFunction> exactDistance(const Console& console, const std::string& surface,
                                                      const Source& source) {
  return namingSurface(surface, [&] {
    if (isCombined(surface, source)) {
      const DistanceFunction combined = inUnitsOf(source, combinedDistance(console, surface, source));
      warnIfForeign(console, surface, combined.source(), source);
      return std::make_shared<const DistanceFunction>(combined);
    }
    const PreparedSurface prepared = prepareSurface(console, surface, !source.normalization.isIdentity());
    auto exact = distanceTo(console, surface, prepared, distanceOptions(source));
    warnIfForeign(console, surface, exact->source(), source);
    return exact;
  });
}

MeshDistance meshDistance(const Console& console, const std::string& surface, const std::optional<Source>& source,
                          const DistanceOptions& options) {
  return namingSurface(surface, [&] {
    requireMesh(surface);
    PreparedSurface prepared = prepareSurface(console, surface, source && !source->normalization.isIdentity());
    auto distance = distanceToMesh(console, surface, prepared, source ? distanceOptions(*source) : options);
    if (source) warnIfForeign(console, surface, distance->source(), *source);
    return MeshDistance{std::move(prepared.mesh), std::move(distance)};
  });
}

MeshDefects meshDefects(const Console& console, const std::string& surface, const Source& source) {
  return namingSurface(surface, [&] {
    const PreparedSurface prepared = prepareSurface(console, surface, !source.normalization.isIdentity());
    if (prepared.function)
      throw Error(
          fmt::format("{} has no mesh, and so no defects", isGridName(surface) ? "a grid" : "an analytic shape"));
    requireDistanceMemory(prepared.mesh);
    warnIfForeign(console, surface, {.name = prepared.mesh.name, .fingerprint = fingerprint(prepared.mesh)}, source);
    return findDefects(prepared.mesh, withProgress(console, [&](const Progress& progress) {
                         return findCrossings(prepared.mesh, kMaxCrossings, progress);
                       }));
  });
}

}  // namespace hpsdf::app
