#include <fmt/format.h>
#include <fmt/ranges.h>

#include "hpsdf/app/failed.h"
#include "hpsdf/detail/nearest_name.h"
#include "language/expectation.h"
#include "pictures/picture_commands.h"
#include "pictures/readout.h"
#include "session/field_summary.h"
#include "session/session.h"
#include "session/why_report.h"
#include "text/json.h"

namespace hpsdf::app {
namespace {

/// Returns the value, gradient and cell of a field at a point, as JSON.
Json pointFigures(const Vector3& position, double value, std::uint32_t cell, int degree, int depth,
                  const Vector3& gradient) {
  return {{"position", vectorJson(position)}, {"value", value}, {"cell", cell},
          {"degree", degreeJson(degree)},     {"depth", depth}, {"gradient", vectorJson(gradient)},
          {"slope", gradient.norm()}};
}

/// Returns the field's value, gradient and cell at the point that the pixel (x, y) of the last picture shows. Returns
/// null if the pixel shows no part of the field. If `withAll` is true, adds values that take long to compute: the exact
/// distance, if it is known, and the jumps of the field at the nearest face of the cell.
Json pickJson(Session& session, int x, int y, bool withAll) {
  const Field& field = session.current().field;
  const auto pick = render::pickAt(field, session.picture(), x, y);
  if (!pick) return {};
  Json json = pointFigures(pick->position, pick->value, pick->cell, pick->degree, pick->depth,
                           field.valueAndGradient(pick->position).gradient);
  if (!withAll) return json;
  const Readout readout = readoutAt(session, *pick);
  json["jump"] = {{"value", readout.valueJump.max}, {"gradient", readout.gradientJump.max}};
  if (readout.exact) json["exact"] = *readout.exact, json["error"] = readout.value - *readout.exact;
  return json;
}

Json pointJson(Session& session, const Vector3& x, bool withExact) {
  const Field& field = session.current().field;
  const auto [value, gradient] = field.valueAndGradient(x);
  const Cell cell = field.cellAt(x);
  Json json = pointFigures(x, value, cell.id, cell.degree, cell.depth, gradient);
  if (!withExact) return json;
  double exact = 0;
  session.exact("")(std::span(&x, 1), std::span(&exact, 1));
  json["exact"] = exact;
  json["error"] = value - exact;
  return json;
}

Json jumpFigures(const Jumps& jumps) {
  return {{"interfaces", jumps.interfaces.size()},
          {"hanging", jumps.hanging},
          {"area", jumps.area},
          {"max", jumps.value.max},
          {"rms", jumps.value.rms},
          {"gradient_max", jumps.gradient.max},
          {"gradient_rms", jumps.gradient.rms}};
}

Json figuresOf(Session& session, const Expectation& expectation) {
  const auto& n = expectation.arguments;
  if (expectation.source == "stats") return fieldJson(session.current());
  if (expectation.source == "jumps") return jumpFigures(session.jumps());
  if (expectation.source == "at") {
    const bool withExact = expectation.path[0] == "exact" || expectation.path[0] == "error";
    return pointJson(session, {n[0], n[1], n[2]}, withExact);
  }
  if (expectation.source == "why") return whyJson(whyAt(session, "", {n[0], n[1], n[2]}));
  const std::string& figure = expectation.path[0];
  const bool withAll = figure == "jump" || figure == "exact" || figure == "error";
  Json pick = pickJson(session, static_cast<int>(n[0]), static_cast<int>(n[1]), withAll);
  if (pick.is_null()) throw Failed(fmt::format("pixel {},{} shows no part of the field", n[0], n[1]));
  return pick;
}

/// Returns the number in `json` at the key path of the expectation, such as stats.leaves. If there is no such key,
/// throws `Error` with the most similar key. The degree of an exact leaf counts as `kExactDegree`.
double numberAt(Json json, const Expectation& expectation) {
  std::string path = expectation.source;
  for (const std::string& key : expectation.path) {
    const bool isElement = json.is_array() && parseNumber(key) && json.size() > std::size_t(*parseNumber(key));
    if (!isElement && !(json.is_object() && json.contains(key))) {
      std::vector<std::string> known;
      for (const auto& [name, value] : json.items()) known.push_back(name);
      throw Error(fmt::format("{} has no '{}'; {}", path, key,
                              didYouMean(key, known, fmt::format("it has {}", fmt::join(known, ", ")))));
    }
    json = isElement ? Json(json[std::size_t(*parseNumber(key))]) : Json(json[key]);
    path += "." + key;
  }
  if (expectation.isOfDegree() && json.is_string()) return kExactDegree;
  if (!json.is_number()) throw Error(fmt::format("{} is no number", path));
  return json.get<double>();
}

void runPick(Session& session, const Arguments& arguments) {
  const auto pixel = arguments.numbers("pixel");
  const Json pick = pickJson(session, static_cast<int>(pixel[0]), static_cast<int>(pixel[1]), false);
  std::ostream& out = session.console().out;
  if (session.wantsJson(arguments)) return printJson(out, pick);
  if (pick.is_null()) {
    out << fmt::format("pixel {},{}: no part of the field\n", pixel[0], pixel[1]);
    return;
  }
  const auto& p = pick["position"];
  out << fmt::format(
      "pixel {},{}: ({:.6g}, {:.6g}, {:.6g}), value {:.6g}, cell {}, degree {}, depth {}, slope {:.6g}\n", pixel[0],
      pixel[1], p[0].get<double>(), p[1].get<double>(), p[2].get<double>(), pick["value"].get<double>(),
      pick["cell"].get<std::uint32_t>(), degreeText(pick["degree"]), pick["depth"].get<int>(),
      pick["slope"].get<double>());
}

std::string expressionOf(const Arguments& arguments) {
  return fmt::format("{}", fmt::join(arguments.texts("expression"), " "));
}

void runExpect(Session& session, const Arguments& arguments) {
  const std::string text = expressionOf(arguments);
  const Expectation expectation = parseExpectation(text);
  const double found = numberAt(figuresOf(session, expectation), expectation);
  const bool isExact = expectation.isOfDegree() && found == kExactDegree;
  const Json shown = isExact ? degreeJson(kExactDegree) : Json(found);
  if (!expectation.holds(found))
    throw Failed(
        fmt::format("expected {}, found {}", text, isExact ? levelName(kExactDegree) : fmt::format("{}", found)));
  if (session.wantsJson(arguments)) printJson(session.console().out, {{"expected", text}, {"found", shown}});
}

}  // namespace

void addFigureCommands(Registry& registry) {
  registry.addForScripts({
      .name = "pick",
      .summary = "Tell what a pixel of the last picture shows.",
      .help = "Position, value as it was drawn, cell, degree and depth, and the field's gradient there. Pixels are "
              "counted from the upper left corner of the whole picture; of several samples the middle one is taken.",
      .examples = {"pick 640,360", "pick 100,200 json=true"},
      .parameters = {{"pixel", wholeNumbers("X,Y", {2}).within(0, 16383).positional().required(), "Column and row."}},
      .action = runPick,
  });
  registry.addForScripts({
      .name = "expect",
      .summary = "Check a figure: the script ends with status 1 where it does not hold.",
      .help = paragraphs(R"(
EXPRESSION is FIGURE OPERATOR NUMBER, the operator ==, !=, <, <=, > or >=; with == and !=, 'within' and a tolerance may
follow. Figures are

stats.NAME: what 'info --json' says, e.g. stats.leaves, stats.rms_estimate, stats.degree_volume.3;

jumps.NAME: interfaces, hanging, area, max, rms, gradient_max, gradient_rms;

pick(x,y).NAME: what the last picture shows at a pixel: position.0, value, cell, degree, depth, gradient.0, slope; exact
and error where the exact distance is known; jump.value and jump.gradient at the nearest face of its cell;

at(x,y,z).NAME: the same at a point of the field, also exact and error where the exact distance is known;

why(x,y,z).NAME: what 'why --json' says of the cell at a point: degree, depth, estimated_rms, measured_rms, measured_max,
raised and divided (how often), agrees (1 or 0), nearest.triangle, sign.winding_number, steps.0.degree.

The degree of an exact cell is written as exact, and counts as 31, which is greater than every other degree.)"),
      .examples = {"expect stats.leaves < 60000", "expect jumps.max < 1e-2", "expect pick(640,360).degree == 4",
                   "expect pick(640,360).degree == exact", "expect at(0,0,0.5).value == 0.1 within 1e-5",
                   "expect why(0,0,0.5).measured_max < 1e-4"},
      .parameters = {{"expression", text("EXPRESSION").positional().repeatable().required(), "What should hold."}},
      .action = runExpect,
      .check = [](const Arguments& arguments) { parseExpectation(expressionOf(arguments)); },
  });
}

}  // namespace hpsdf::app
