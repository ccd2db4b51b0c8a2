#include "session/asked_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "session/field_summary.h"
#include "text/text.h"

namespace hpsdf::app {

std::string missedErrors(const Arguments& arguments, const Field& field) {
  if (missesTolerance(field))
    return fmt::format(
        "tolerance: {}: take a larger tolerance; where the distance jumps because the mesh has holes or intersects "
        "itself, repair the mesh first ('hpsdf mesh --help')",
        toleranceText(field));
  const std::optional<Measurement>& m = field.metadata().measurement;
  if (!m) return "";
  std::string missed;
  const auto compare = [&](const char* name, const char* kind, double measured) {
    if (!arguments.given(name) || measured <= arguments.number(name)) return;
    missed +=
        fmt::format("{}{}: {} of {} was measured, more than the {} that was asked for", missed.empty() ? "" : "; ",
                    name, kind, shortNumber(measured), shortNumber(arguments.number(name)));
  };
  compare("near-error", "an RMS error near the surface", m->near.rms);
  compare("far-error", "an RMS error over the domain", m->domain.rms);
  compare("max-error", "an error", std::max(m->near.max, m->domain.max));
  if (missed.empty()) return "";
  return missed + ": ask for less than that, or allow a higher degree, a greater depth or more bytes";
}

}  // namespace hpsdf::app
