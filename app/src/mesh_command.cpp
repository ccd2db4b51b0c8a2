#include "mesh_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "building.h"
#include "failed.h"
#include "hpsdf/crossings.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_import.h"
#include "hpsdf/sign_check.h"
#include "long_work.h"
#include "summaries.h"

namespace hpsdf::app {
namespace {

constexpr std::size_t kPlacesInText = 3;

struct Inspected {
  ImportedMesh imported;
  Crossings crossings = {};
  SignChoice choice = {};
  std::optional<SignCheck> check = {};
};

Inspected inspected(Session& session, const Arguments& arguments) {
  Inspected found{.imported = importSurface(session.console(), arguments.text("mesh"))};
  const TriangleMesh& mesh = found.imported.mesh;
  const ExactDistance distance(mesh);
  found.crossings = findCrossings(mesh);
  found.choice = distance.signChoice();
  if (arguments.given("check-sign"))
    found.check = withProgress(session.console(), [&](const Progress& progress) {
      return checkSign(mesh, distance, static_cast<std::size_t>(arguments.number("check-sign")),
                       static_cast<std::uint64_t>(arguments.number("seed")), progress);
    });
  return found;
}

Json crossingsJson(const Crossings& crossings, std::size_t limit) {
  Json places = Json::array();
  for (std::size_t i = 0; i < std::min(limit, crossings.found.size()); ++i) {
    const Crossing& crossing = crossings.found[i];
    places.push_back({{"faces", crossing.triangles}, {"at", vectorJson(crossing.place)}});
  }
  return {{"count", crossings.found.size()}, {"all", crossings.all}, {"places", std::move(places)}};
}

Json checkJson(const SignCheck& check) {
  Json json{{"places", check.places}, {"nearer_than", check.nearest}, {"near", check.tooNear}, {"wrong", check.wrong}};
  if (check.wrong > 0) json["worst"] = {{"at", vectorJson(check.worst)}, {"distance", check.depth}};
  return json;
}

std::string crossingsText(const Crossings& crossings) {
  if (crossings.found.empty()) return summaryRow("meets itself", "nowhere");
  std::string text = grouped(crossings.found.size()) + (crossings.found.size() == 1 ? " pair" : " pairs") + " of faces";
  if (!crossings.all) text = "at least " + text;
  text += ", as at ";
  for (std::size_t i = 0; i < std::min(kPlacesInText, crossings.found.size()); ++i)
    text += (i == 0 ? "" : ", ") + vectorText(crossings.found[i].place);
  return summaryRow("meets itself", text);
}

std::string spacingText(const std::string& surface, const TriangleMesh& mesh) {
  const double spacing = coordinateSpacing(surface, mesh);
  if (spacing == 0) return "";
  return summaryRow("coordinates", fmt::format("kept {} apart by the reader", shortNumber(spacing)));
}

std::string checkText(const SignCheck& check) {
  std::string text = summaryRow(
      "sign checked", fmt::format("at {} places, {} of them nearer than {} to the surface", grouped(check.places),
                                  grouped(check.tooNear), shortNumber(check.nearest)));
  return text + summaryRow("wrong signs",
                           check.wrong == 0
                               ? "0"
                               : fmt::format("{}, the farthest from the surface at {}, {} away", grouped(check.wrong),
                                             vectorText(check.worst), shortNumber(check.depth)));
}

void runMesh(Session& session, const Arguments& arguments) {
  const std::string surface = arguments.text("mesh");
  if (arguments.given("seed") && !arguments.given("check-sign"))
    throw Error("seed belongs to check-sign: give that too, or leave it out");
  const Inspected found = inspected(session, arguments);
  if (session.wantsJson(arguments)) {
    Json json = meshJson(surface, found.imported.report);
    json["coordinate_spacing"] = coordinateSpacing(surface, found.imported.mesh);
    json["crossings"] = crossingsJson(found.crossings, static_cast<std::size_t>(arguments.number("places")));
    json["sign"] = {{"by", signName(found.choice.sign)}, {"because", found.choice.reason}};
    if (found.check) json["sign_check"] = checkJson(*found.check);
    printJson(session.console().out, json);
  } else {
    session.console().out << meshText(surface, found.imported.report) << spacingText(surface, found.imported.mesh)
                          << crossingsText(found.crossings)
                          << summaryRow("sign", signName(found.choice.sign) + ": " + found.choice.reason)
                          << (found.check ? checkText(*found.check) : "");
  }
  if (found.check && found.check->wrong > 0)
    throw Failed(fmt::format("{}: {} of {} signs are wrong", surface, found.check->wrong, found.check->places));
}

}  // namespace

Command meshCommand() {
  return {
      .name = "mesh",
      .summary = "Tell what was found in a mesh, and how its inside is told.",
      .help =
          "Counts after welding equal positions, parts, edges that are open, shared by more than two faces or run "
          "against each other, volume, area, box, and what was dropped or turned on import. Where faces meet others "
          "that are no neighbours, or neighbours beyond what they share: decided without rounding. And the sign "
          "that 'hpsdf build' would take by itself (--sign auto), with the reason.\n"
          "\n"
          "--check-sign compares that sign with the winding number summed over all faces, at random places: half "
          "of them in and around the mesh's box, half close to its faces. Exit status 1 where one is wrong that is "
          "farther from the surface than a millionth of the mesh's longest side.",
      .examples = {"hpsdf mesh bunny.obj", "hpsdf mesh builtin:gear --json",
                   "hpsdf mesh bunny.obj --check-sign 100000"},
      .parameters = {{.name = "mesh",
                      .type = ParameterType::text,
                      .help = "Mesh file or builtin:SHAPE.",
                      .valueName = "MESH",
                      .positional = true,
                      .need = Need::always},
                     {.name = "places",
                      .type = ParameterType::wholeNumber,
                      .help = "Of json: so many places at most where the mesh meets itself.",
                      .defaultText = "100",
                      .minimum = 0,
                      .maximum = 1e6},
                     {.name = "check-sign",
                      .type = ParameterType::wholeNumber,
                      .help = "Compare signs at so many random places: some 15 ns for each and each face.",
                      .valueName = "PLACES",
                      .minimum = 1,
                      .maximum = 1e9},
                     {.name = "seed",
                      .type = ParameterType::wholeNumber,
                      .help = "Of the random places.",
                      .defaultText = "1",
                      .minimum = 0,
                      .maximum = 9007199254740992}},
      .action = runMesh};
}

}  // namespace hpsdf::app
