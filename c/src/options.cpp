#include "call.h"
#include "handles.h"

using namespace hpsdf;

hpsdf_status hpsdf_options_new(hpsdf_options** options) {
  return c::create(options, "options", [] { return GivenSettings(); });
}

hpsdf_status hpsdf_options_set(hpsdf_options* options, const char* name, const char* value) {
  return c::guarded([&] {
    c::requirePointer(options, "options");
    c::requirePointer(name, "name");
    if (value == nullptr)
      options->settings.takeBack(name);
    else
      options->settings.give(name, value);
  });
}

void hpsdf_options_free(hpsdf_options* options) { delete options; }
