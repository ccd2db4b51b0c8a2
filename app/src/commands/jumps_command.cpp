#include <fmt/format.h>

#include <cmath>

#include "commands/commands.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/jumps.h"
#include "session/field_argument.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr double kBarLength = 40;

JumpKind jumpKind(const Arguments& arguments) {
  return arguments.text("by") == "gradient" ? JumpKind::gradient : JumpKind::value;
}

std::string kindName(JumpKind kind) { return kind == JumpKind::value ? "value" : "gradient"; }

Json jumpJson(const Jump& jump) { return {{"rms", jump.rms}, {"max", jump.max}}; }

std::string jumpText(const Jump& jump) {
  return fmt::format("RMS {}, greatest {}", shortNumber(jump.rms), shortNumber(jump.max));
}

Json interfaceJson(const Interface& face) {
  return {{"cells", face.cells},
          {"degrees", {degreeJson(face.degrees[0]), degreeJson(face.degrees[1])}},
          {"depths", face.depths},
          {"axis", face.axis},
          {"area", face.area},
          {"center", vectorJson(face.center)},
          {"worst", vectorJson(face.worst)},
          {"value", jumpJson(face.value)},
          {"gradient", jumpJson(face.gradient)}};
}

struct Row {
  std::string label;
  double from;
  JumpBin bin;
};

/// Returns a histogram of the jumps across cell faces, one row for each power of ten. If some faces have no jump at
/// all, an additional first row counts these faces.
std::vector<Row> histogramRows(const Jumps& jumps, JumpKind kind) {
  Row exact{"0", 0, {jumps.interfaces.size(), jumps.area}};
  std::vector<Row> rows;
  for (const auto& [decade, bin] : jumpHistogram(jumps, kind)) {
    rows.push_back({fmt::format("1e{} to 1e{}", decade, decade + 1), std::pow(10.0, decade), bin});
    exact.bin.interfaces -= bin.interfaces;
    exact.bin.area -= bin.area;
  }
  if (exact.bin.interfaces > 0) rows.insert(rows.begin(), exact);
  return rows;
}

Json histogramJson(const Jumps& jumps, JumpKind kind) {
  Json json = Json::array();
  for (const Row& row : histogramRows(jumps, kind))
    json.push_back({{"from", row.from}, {"interfaces", row.bin.interfaces}, {"area", row.bin.area}});
  return json;
}

Json jumpsJson(const Jumps& jumps, JumpKind by, std::size_t count) {
  Json worst = Json::array();
  for (const std::size_t n : worstInterfaces(jumps, by, count)) worst.push_back(interfaceJson(jumps.interfaces[n]));
  return {{"interfaces", jumps.interfaces.size()},
          {"hanging", jumps.hanging},
          {"area", jumps.area},
          {"value", jumpJson(jumps.value)},
          {"gradient", jumpJson(jumps.gradient)},
          {"value_histogram", histogramJson(jumps, JumpKind::value)},
          {"gradient_histogram", histogramJson(jumps, JumpKind::gradient)},
          {"worst_by", kindName(by)},
          {"worst", worst}};
}

std::string histogramText(const Jumps& jumps, JumpKind kind) {
  std::string text = fmt::format("\n  {:<22} {:>8} {:>12}\n", kindName(kind) + " jump", "area", "interfaces");
  for (const Row& row : histogramRows(jumps, kind)) {
    const double share = row.bin.area / jumps.area;
    text += fmt::format("  {:<22} {:>6.2f} % {:>12}  {:▇<{}}\n", row.label, 100 * share, grouped(row.bin.interfaces),
                        "", int(std::ceil(share * kBarLength)));
  }
  return text;
}

std::string worstText(const Jumps& jumps, JumpKind by, std::size_t count) {
  std::string text = fmt::format("\n  {:>4} {:>10} {:>10}  {:<34} {:>4}  {:<16} {}\n", "", "value", "gradient", "at",
                                 "axis", "degrees, depths", "cells");
  int rank = 0;
  for (const std::size_t n : worstInterfaces(jumps, by, count)) {
    const Interface& face = jumps.interfaces[n];
    text += fmt::format("  {:>4} {:>10} {:>10}  {:<34} {:>4}  {:<16} {}\n", ++rank, shortNumber(face.value.max),
                        shortNumber(face.gradient.max), vectorText(face.worst), "xyz"[face.axis],
                        fmt::format("{}|{}, {}|{}", levelName(face.degrees[0]), levelName(face.degrees[1]),
                                    face.depths[0], face.depths[1]),
                        fmt::format("{}|{}", face.cells[0], face.cells[1]));
  }
  return text;
}

std::string jumpsText(const std::string& name, const Jumps& jumps, JumpKind by, std::size_t count) {
  std::string text = name + "\n";
  text += summaryRow("interfaces", fmt::format("{}, {} of them between cells of different size",
                                               grouped(jumps.interfaces.size()), grouped(jumps.hanging)));
  text += summaryRow("value jump", jumpText(jumps.value)) + summaryRow("gradient jump", jumpText(jumps.gradient));
  if (jumps.interfaces.empty()) return text;
  text += histogramText(jumps, JumpKind::value) + histogramText(jumps, JumpKind::gradient);
  if (count > 0) text += worstText(jumps, by, count);
  return text;
}

void writeTable(const Jumps& jumps, const std::string& file) {
  OutputFile out(file);
  out.write(
      "cell0,cell1,degree0,degree1,depth0,depth1,axis,area,x,y,z,value_rms,value_max,gradient_rms,gradient_max,"
      "worst_x,worst_y,worst_z\n");
  for (const Interface& face : jumps.interfaces)
    out.write(fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", face.cells[0], face.cells[1],
                          levelName(face.degrees[0]), levelName(face.degrees[1]), face.depths[0], face.depths[1],
                          face.axis, face.area, face.center.x(), face.center.y(), face.center.z(), face.value.rms,
                          face.value.max, face.gradient.rms, face.gradient.max, face.worst.x(), face.worst.y(),
                          face.worst.z()));
  out.commit();
}

void runJumps(Session& session, const Arguments& arguments) {
  useField(session, arguments);
  const bool writes = arguments.has("output");
  if (writes) checkWritable(arguments.text("output"));
  const Jumps& jumps = session.jumps();
  const auto count = static_cast<std::size_t>(arguments.whole("worst"));
  if (writes) writeTable(jumps, arguments.text("output"));
  if (session.wantsJson(arguments))
    return printJson(session.console().out, jumpsJson(jumps, jumpKind(arguments), count));
  session.console().out << jumpsText(session.current().name, jumps, jumpKind(arguments), count);
}

}  // namespace

void addJumpsCommand(Registry& registry) {
  registry.add({
      .name = "jumps",
      .summary = "Measure how much a field jumps between its cells.",
      .help = paragraphs(R"(
The polynomials of neighbouring leaves do not agree on the interface between them. For each interface the command
measures the jump of the value and of the gradient: the RMS over the interface (exact), and the greatest jump at
quadrature points, edges and corners. It prints totals, histograms by powers of ten, and the worst interfaces with their
positions. Lengths are in the field's units; jumps of the gradient have no unit.

Use it to decide whether a field needs continuity, see 'build --continuity'. With -o it also writes a CSV table of all
interfaces: cells, degrees and depths on the side of smaller and of greater coordinates, the axis across the interface
(0, 1, 2), area, centre, jumps, and the position of the greatest jump of the value.)"),
      .examples = {"hpsdf jumps bunny.hpsdf", "hpsdf jumps bunny.hpsdf --by gradient --worst 3",
                   "hpsdf jumps bunny.hpsdf -o interfaces.csv --json"},
      .parameters = {fieldParameter(),
                     {"worst", wholeNumber().within(0, 1000000).byDefault("10"), "Number of worst interfaces to list."},
                     {"by", choice({"value", "gradient"}).byDefault("value"),
                      "Ranks the worst interfaces by their jump of the value or of the gradient."},
                     {"output", outputFile().as('o'), "CSV file of all interfaces."}},
      .action = runJumps,
  });
}

}  // namespace hpsdf::app
