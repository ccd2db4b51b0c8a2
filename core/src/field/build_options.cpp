#include "hpsdf/build_options.h"

#include <algorithm>
#include <cmath>

#include "hpsdf/error.h"

namespace hpsdf {

BuildOptions paperOptions() {
  BuildOptions options;
  options.nearness = 4;
  options.maxDegree = 30;
  options.maxDepth = 10;
  options.strategy = Strategy::hp;
  options.estimator = Estimator::embedded;
  options.quadrature = 4;
  options.cubature = CubatureKind::product;
  options.trialSamples = TrialSamples::own;
  options.coefficients = CoefficientType::float64;
  return options;
}

AllowedError allowedError(const BuildOptions& options, double referenceLength) {
  constexpr double kShareWithin = 0.05;
  const double within = options.within > 0 ? options.within : kShareWithin * referenceLength;
  return {options.tolerance, std::max(within, options.tolerance)};
}

Box domainAround(const Box& surface, DomainShape shape, double margin) {
  if (surface.isEmpty()) throw Error("cannot place a domain around an empty surface");
  if (!(margin > -1) || !std::isfinite(margin)) throw Error("margin: expected a number above -1");
  const Vector3 centre = surface.center();
  Vector3 half = surface.sizes() / 2;
  if (shape == DomainShape::cube) half.setConstant(half.maxCoeff());
  half *= 1 + margin;
  return Box(centre - half, centre + half);
}

Box domainAround(const TriangleMesh& mesh, DomainShape shape, double margin) {
  return domainAround(boundingBox(mesh), shape, margin);
}

}  // namespace hpsdf
