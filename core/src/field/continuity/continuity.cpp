#include "hpsdf/continuity.h"

#include <cmath>
#include <string>
#include <utility>

#include "field/continuity/weak_continuity.h"
#include "field/query/float_coefficients.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"

namespace hpsdf {

WeaklyContinuous weaklyContinuous(const Field& field, const WeakContinuity& options, int threads,
                                  const Progress& progress) {
  continuity::checkWeakContinuity(options);
  if (field.metadata().settings.continuityWeight)
    throw Error("the field is weakly continuous already: take it as it was before, or build it anew");
  FieldData data = field.data();
  query::toDouble(data);
  const continuity::WeakContinuityFigures figures =
      withThreads(threads, [&] { return continuity::makeWeaklyContinuous(data, options, progress); });
  if (field.singlePrecision()) {
    data.metadata.roundingRms = std::hypot(data.metadata.roundingRms, query::floatRounding(data).rms);
    query::toFloat(data);
  }
  return {Field(std::move(data)), figures.iterations, figures.residual, figures.change};
}

Field blended(const Field& field, double width) {
  if (!(width >= 0 && width <= kMaxBlend))
    throw Error("blend zones of a width of " + std::to_string(width) + " edges are out of range: give 0 to 0.25");
  FieldData data = field.data();
  data.blend = width;
  data.bounds.clear();  // Bounds depend on the leaves that have a weight, which blending changes.
  return Field(std::move(data));
}

}  // namespace hpsdf
