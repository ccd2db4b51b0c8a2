#pragma once
// What is known of a mesh or a field, for people and for machines.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>

#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_report.h"
#include "session/current_field.h"

namespace hpsdf::app {

using Json = nlohmann::ordered_json;

/// Indented, ending in a newline; names that are not UTF-8 are mended rather than refused.
void printJson(std::ostream& out, const Json& json);

Json meshJson(const std::string& name, const MeshReport& report);
std::string meshText(const std::string& name, const MeshReport& report);

std::string closednessText(const MeshReport& report);

/// As `--sign` has them; "unknown" for `automatic`.
std::string insideTestName(InsideTest sign);

/// "the mesh meets itself, as at (0, 1, 2)"; `mesh`: its box.
std::string reasonText(const InsideTestChoice& choice, const Box& mesh);

/// One line for a mesh that is not closed and yet is to have its sign by pseudonormals.
std::string unsureSigns(const std::string& name, const MeshReport& report);

Json fieldJson(const CurrentField& current);
std::string fieldText(const CurrentField& current);

/// In what units the estimated RMS error of `fieldLine` and `fieldText` is, in parentheses.
std::string unitText(const Field& field);

/// "54,935 leaves, 460,210 coefficients (float32), 2.3 MB"
std::string fieldLine(const Field& field);

/// 1234567 → "1,234,567"
std::string grouped(std::uint64_t number);

/// "1 face", "1,234 faces"
std::string countOf(std::size_t count, std::string_view one, std::string_view many);

/// Three digits, and a short exponent where it saves zeros: 1e-6, 3.06e-4, 0.125
std::string shortNumber(double number);

Json vectorJson(const Vector3& v);
/// "(0.1, 0.2, 0.3)"
std::string vectorText(const Vector3& v);
/// With as many digits more as a place in a box far from the origin needs.
std::string vectorText(const Vector3& v, const Box& box);
/// "(0, 0, 0) to (1, 2, 3)", with as many digits more as it lies farther from the origin than it is long.
std::string boxText(const Box& box);

/// ".png" of a.PNG
std::string lowerExtension(const std::filesystem::path& file);

/// "bunny" of bunny.obj, "torus" of builtin:torus,major=0.7: plain characters only, for commands and file names.
std::string plainName(const std::string& source);

/// A word of a command as a shell takes it, quoted where it must be.
std::string shellWord(const std::string& word);

/// An indented line of a summary.
std::string summaryRow(std::string_view label, const std::string& value);

std::string strategyName(Strategy strategy);
std::string nearnessName(NearnessKind kind);
std::string estimatorName(Estimator estimator);
std::string criterionName(Criterion criterion);
std::string continuityName(const Field& field);  ///< none, weak, exact or both

}  // namespace hpsdf::app
