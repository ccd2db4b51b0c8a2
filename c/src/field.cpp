#include "hpsdf/field.h"

#include <algorithm>

#include "arguments.h"
#include "call.h"
#include "handles.h"
#include "hpsdf/field_file.h"

using namespace hpsdf;

hpsdf_status hpsdf_field_load(const char* file, hpsdf_field** field) {
  return c::create(field, "field", [&] {
    c::requirePointer(file, "file");
    return load(file);
  });
}

hpsdf_status hpsdf_field_map(const char* file, hpsdf_field** field) {
  return c::create(field, "field", [&] {
    c::requirePointer(file, "file");
    return load(file, Loading::mapped);
  });
}

hpsdf_status hpsdf_field_save(const hpsdf_field* field, const char* file, int compress) {
  return c::guarded([&] {
    c::requirePointer(field, "field");
    c::requirePointer(file, "file");
    save(field->field, file, {.compress = compress != 0});
  });
}

hpsdf_status hpsdf_field_values(const hpsdf_field* field, const double* points, size_t count, double* values) {
  return c::guarded([&] {
    c::requirePointer(field, "field");
    const auto given = c::vectorsOf(points, count, "points");
    const auto out = c::arrayOf(values, count, "values");
    if (count == 1)
      out[0] = field->field.value(given[0]);  // takes less time than a batch of one point
    else
      field->field.values(given, out);
  });
}

hpsdf_status hpsdf_field_gradients(const hpsdf_field* field, const double* points, size_t count, double* values,
                                   double* gradients) {
  return c::guarded([&] {
    c::requirePointer(field, "field");
    const auto given = c::vectorsOf(points, count, "points");
    const auto out = c::arrayOf(values, count, "values");
    const auto gradientsOut = c::vectorsOf(gradients, count, "gradients");
    if (count == 1) {
      const ValueAndGradient both = field->field.valueAndGradient(given[0]);
      out[0] = both.value;
      gradientsOut[0] = both.gradient;
    } else {
      field->field.valuesAndGradients(given, out, gradientsOut);
    }
  });
}

hpsdf_status hpsdf_field_domain(const hpsdf_field* field, double* box) {
  return c::guarded([&] {
    c::requirePointer(field, "field");
    c::requirePointer(box, "box");
    const Box& domain = field->field.domain();
    std::copy_n(domain.min().data(), 3, box);
    std::copy_n(domain.max().data(), 3, box + 3);
  });
}

size_t hpsdf_field_bytes(const hpsdf_field* field) { return field == nullptr ? 0 : field->field.bytes(); }

void hpsdf_field_free(hpsdf_field* field) { delete field; }
