// Fuzz target: a `.hpsdf` file that loads can be queried at any point and is saved again without change.
#include "hpsdf/field_file.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hpsdf/detail/line.h"
#include "hpsdf/safe_distance.h"
#include "session/current_field.h"
#include "session/field_summary.h"
#include "support/file_checksums.h"
#include "target.h"
#include "text/json.h"

namespace {

using namespace hpsdf;

/// Returns the version of a file. It tells, too, whether the arrays are compressed.
std::string_view versionOf(std::string_view file) { return file.substr(8, 4); }

/// Returns true for a file whose blocks each have a checksum.
bool isBlocked(std::string_view file) {
  return file.size() > 12 && versionOf(file) == std::string_view("\x0c\0\0\0", 4);
}

/// Returns points within the domain, on its sides and around it, and points that are infinite or NaN.
std::vector<Vector3> placesOf(const Box& domain) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr std::array kParts = {-0.5, 0.0, 0.137, 0.5, 0.71, 1.0, 1.0 + 1e-15, 3.0};
  std::vector<Vector3> places = {Vector3::Constant(NAN), Vector3::Constant(kInfinity), Vector3::Constant(-1e300)};
  for (const double x : kParts)
    for (const double y : kParts)
      for (const double z : kParts)
        places.push_back(domain.min() + Vector3(x, y, z).cwiseProduct(domain.max() - domain.min()));
  return places;
}

bool isSame(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void askEverywhere(const Field& field) {
  const std::vector<Vector3> places = placesOf(field.domain());
  std::vector<double> values(places.size());
  std::vector<ValueAndGradient> answers(places.size());
  field.values(places, values);
  field.valuesAndGradients(places, answers);
  for (std::size_t n = 0; n < places.size(); ++n) {
    fuzz::require(isSame(field.value(places[n]), values[n]), "a batch has the value of one point");
    fuzz::require(isSame(field.valueAndGradient(places[n]).value, answers[n].value), "and with the gradient");
  }
}

/// Asks a mapped field, whose coefficients nobody has checked.
void askMapped(const std::filesystem::path& file) {
  const Field field = load(file, Loading::mapped);
  const std::vector<Vector3> places = placesOf(field.domain());
  std::vector<double> values(places.size());
  field.values(places, values);
  for (const Vector3& place : places) {
    field.value(place);
    field.valueGradientHessian(place);
  }
  field.forEachCell([](const Cell&) {});
}

void lookAtCells(const Field& field) {
  std::size_t leaves = 0;
  field.forEachCell([&](const Cell& cell) {
    ++leaves;
    const Cell found = field.cellAt(cell.box.center());
    const bool isThin = (cell.box.sizes().array() <= 1e-12 * field.domain().sizes().array()).any() ||
                        (cell.box.center().cwiseAbs().array() * 1e-9 > cell.box.sizes().array()).any();
    fuzz::require(isThin || found.id == cell.id, "a leaf is found at its centre");
  });
  fuzz::require(statistics(field).leaves == leaves, "there are as many leaves as are visited");
}

void goThrough(const Field& field) {
  const Vector3 from = field.domain().min(), to = field.domain().max();
  fuzz::reads([&] { jumpsAlong(sampleLine(field, from, to, 9)); });
  if (field.data().bounds.empty()) return;
  boundAt(field, from);
  safeDistance(field, to);
}

void describe(const Field& field) {
  const app::CurrentField current{field, "fuzz.hpsdf", std::nullopt, {}};
  for (const unsigned char c : app::fieldText(current))
    fuzz::require(c == '\n' || (c >= ' ' && c != 127), "a summary has no characters that steer a terminal");
  app::fieldLine(field);
  app::fieldJson(current).dump(2, ' ', false, app::Json::error_handler_t::replace);
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t maxSize,
                                               unsigned seed) {
  size = LLVMFuzzerMutate(data, size, maxSize);
  const std::span bytes(reinterpret_cast<char*>(data), size);
  if (seed % 8 == 0) return size;
  if (isBlocked({bytes.data(), size}))
    support::mendBlockChecksums(bytes);
  else
    support::mendChecksum(bytes);
  return size;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes = fuzz::textOf(data, size);
  const auto file = fuzz::fileOf("in.hpsdf", bytes);
  std::optional<Field> field;
  fuzz::reads([&] { askMapped(file); });
  if (!fuzz::reads([&] { field.emplace(load(file)); })) return 0;
  askEverywhere(*field);
  lookAtCells(*field);
  goThrough(*field);
  describe(*field);
  save(*field, file);
  const std::string saved = fuzz::bytesOf(file);
  // Fields of older versions are saved with more data, and compressed ones without compression.
  if (versionOf(bytes) == versionOf(saved)) fuzz::require(saved == bytes, "what was read is written as it was");
  save(load(file), file);
  fuzz::require(fuzz::bytesOf(file) == saved, "what was written is read");
  save(*field, file, {.compress = true});
  save(load(file), file);
  fuzz::require(fuzz::bytesOf(file) == saved, "what was compressed is read");
  return 0;
}
