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
  checkWeakContinuity(options);
  if (field.metadata().continuityWeight > 0)
    throw Error("the field is weakly continuous already: take it as it was before, or build it anew");
  FieldData data = field.data();
  toDouble(data);
  const WeakContinuityFigures figures =
      withThreads(threads, [&] { return makeWeaklyContinuous(data, options, progress); });
  if (field.singlePrecision()) {
    data.metadata.roundingRms = std::hypot(data.metadata.roundingRms, roundingOf(data).rms);
    toFloat(data);
  }
  return {Field(std::move(data)), figures.iterations, figures.residual, figures.change};
}

Field blended(const Field& field, double width) {
  if (!(width >= 0 && width <= kMaxBlend))
    throw Error("blended zones of a width of " + std::to_string(width) + " edges are out of range: give 0 to 0.25");
  FieldData data = field.data();
  data.blend = width;
  data.bounds.clear();  // neighbours have a say in a leaf now, or no more
  return Field(std::move(data));
}

}  // namespace hpsdf
