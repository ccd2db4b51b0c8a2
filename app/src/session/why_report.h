#pragma once
// The reasons for which a field is as it is at a point: the history of its leaf, the nearest triangle and the sign.

#include <optional>
#include <string>
#include <vector>

#include "construction/reference_surface.h"
#include "hpsdf/cell_history.h"
#include "session/session.h"
#include "text/json.h"

namespace hpsdf::app {

struct WhyReport {
  Vector3 point;
  double value, exact;  ///< of the field and of the surface at the point
  CellHistory history;
  std::optional<ClosestPoint> nearest;  ///< missing for an analytic shape
  std::optional<double> windingNumber;  ///< of the mesh about the point; missing for an analytic shape and for a shell
  const Field& field;
};

/// Repeats the construction of the current field at a point. `surface` is what the field was made from, or "" if the
/// session knows it. Throws `Error` if the point lies outside the field's domain, and for another surface.
WhyReport whyAt(Session& session, const std::string& surface, const Vector3& x);

Json whyJson(const WhyReport& report);
/// Returns the report as lines of text.
std::string whyText(const WhyReport& report);
/// Returns the report in a few lines, for the explorer.
std::vector<std::string> whyLines(const WhyReport& report);

}  // namespace hpsdf::app
