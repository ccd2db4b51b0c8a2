#pragma once
// What is known of a field, for people and for machines.

#include <string>

#include "session/current_field.h"
#include "text/json.h"

namespace hpsdf::app {

Json fieldJson(const CurrentField& current);
std::string fieldText(const CurrentField& current);

/// In what units the estimated RMS error of `fieldLine` and `fieldText` is, in parentheses.
std::string unitText(const Field& field);

/// "54,935 leaves, 460,210 coefficients (float32), 2.3 MB"
std::string fieldLine(const Field& field);

std::string strategyName(Strategy strategy);
std::string nearnessName(NearnessKind kind);
std::string estimatorName(Estimator estimator);
std::string criterionName(Criterion criterion);
std::string continuityName(const Field& field);  ///< none, weak, exact or both

}  // namespace hpsdf::app
