#include <string>

#include "hpsdf/continuity.h"
#include "hpsdf/error.h"

namespace hpsdf {

Field blended(const Field& field, double width) {
  if (!(width >= 0 && width <= kMaxBlend))
    throw Error("blended zones of a width of " + std::to_string(width) + " edges are out of range: give 0 to 0.25");
  FieldData data = field.data();
  data.blend = width;
  data.bounds.clear();  // neighbours have a say in a leaf now, or no more
  return Field(std::move(data));
}

}  // namespace hpsdf
