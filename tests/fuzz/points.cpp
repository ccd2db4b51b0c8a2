// Fuzz target: `hpsdf query` answers each point, or each box, with one line of CSV or with one JSON object.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "commands/point_query.h"
#include "support/one_leaf_field.h"
#include "target.h"

namespace {

using namespace hpsdf;

struct Answers {
  bool all = false;
  std::size_t points = 0;
  std::string text;
};

using Query = decltype(app::queryPoints);

Answers answer(Query* query, const Field& field, std::string_view points, app::PointFormat format) {
  Answers answers;
  std::istringstream in{std::string(points)};
  answers.all = fuzz::reads([&] {
    answers.points = query(field, in, "points.csv", format, [&](std::string_view text) { answers.text += text; });
  });
  return answers;
}

void check(Query* query, std::string_view text) {
  static const Field field = oneLeafField(1, 3);
  const Answers csv = answer(query, field, text, app::PointFormat::csv),
                json = answer(query, field, text, app::PointFormat::json);
  fuzz::require(csv.all == json.all && csv.points == json.points, "both formats take the same points");
  if (!csv.all) return;
  fuzz::require(std::size_t(std::ranges::count(csv.text, '\n')) == csv.points + 1, "a line a point, and the names");
  const auto parsed = nlohmann::json::parse(json.text, nullptr, false);
  fuzz::require(parsed.is_array() && parsed.size() == json.points, "an object a point");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  check(app::queryPoints, fuzz::textOf(data, size));
  check(app::queryBoxes, fuzz::textOf(data, size));
  return 0;
}
