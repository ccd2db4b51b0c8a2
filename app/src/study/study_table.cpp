// `study table`: time, memory and errors of the fields of given meshes (paper, Table 1).

#include <fmt/format.h>

#include <array>
#include <map>
#include <optional>
#include <set>

#include "console/interrupt.h"
#include "console/version.h"
#include "construction/build_field.h"
#include "files/html_page.h"
#include "files/output_folder.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/render/markup.h"
#include "hpsdf/render/picture.h"
#include "hpsdf/verify.h"
#include "language/script.h"
#include "pictures/legends.h"
#include "pictures/picture_arguments.h"
#include "session/backend.h"
#include "session/field_summary.h"
#include "session/session.h"
#include "study/study_command.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr int kThumbnail = 200;  // side of a slice's picture, pixels
constexpr int kBar = 300;        // length in pixels of a bar, which stands for the whole volume

/// A property of the cells that pictures show by colours: the degree or the depth.
struct Level {
  render::ColorBy color;
  const char *name, *title;
  std::map<int, double> FieldStatistics::*volume;
};
constexpr std::array kLevels = {Level{render::ColorBy::degree, "degree", "Degree", &FieldStatistics::degreeVolume},
                                Level{render::ColorBy::depth, "depth", "Depth", &FieldStatistics::depthVolume}};

/// A picture of a slice through the middle of the surface, coloured by degree or depth, and a bar in the same colours.
/// The bar shows which share of the domain's volume each degree or depth takes.
struct LevelPicture {
  std::string png = {};     ///< bytes of the slice's PNG file
  std::string svg = {};     ///< the bar as SVG text
  LevelColors colors = {};  ///< colours of the degrees or depths that occur in any row
};

/// A mesh and its field, which make one row of the table.
struct TableRow {
  std::string mesh;
  std::string name;  ///< name of the mesh in file names
  Field field;
  FieldStatistics figures;
  double seconds;                                              ///< time of the construction
  ErrorFigures error;                                          ///< measured error, in the field's units
  std::array<LevelPicture, std::size(kLevels)> pictures = {};  ///< one picture for each of `kLevels`

  double scale() const { return field.metadata().referenceLength / 2; }
  /// Returns the weighted estimate; std::nullopt if the construction made none, as within a tolerance.
  std::optional<double> estimatedRms() const {
    const FieldMetadata& metadata = field.metadata();
    return metadata.hasEstimate() ? std::optional(metadata.rmsEstimate(field.domain()) / scale()) : std::nullopt;
  }
};

TableRow rowOf(Session& session, const Arguments& arguments, std::size_t mesh, const std::string& name) {
  const std::string surface = arguments.texts("mesh")[mesh];
  const Arguments buildArgs = buildArguments(session, arguments, mesh);
  BuiltField built = buildField(session.console(), surface, buildArgs);
  const int threads = buildArgs.whole("threads");
  const ExactSamples samples = exactSamples(session.console(), arguments, *built.exact, built.field.domain(), threads);
  ErrorFigures error = measureError(built.field, samples, threads);
  FieldStatistics figures = statistics(built.field);
  return {surface, name, std::move(built.field), std::move(figures), built.seconds, std::move(error)};
}

LevelPicture pictureOf(render::Renderer& renderer, const TableRow& row, const Level& level,
                       const std::vector<int>& levels) {
  const render::SlicePicture picture{.plane = render::AxisPlane{2, defaultOffset(shownBox(row.field), 2)},
                                     .color = level.color,
                                     .width = kThumbnail,
                                     .height = kThumbnail,
                                     .samples = 2,
                                     .scale = {.levels = levels},
                                     .bare = true};
  const render::Drawn drawn = render::drawSlice(renderer, row.field, picture);
  LevelPicture made{.png = pngBytes(drawn.image)};
  made.colors = levelColors(drawn.legend);
  made.svg = sharesSvg(kBar, row.figures.*level.volume, made.colors, true);
  return made;
}

void drawPictures(Session& session, const Backend& backend, std::vector<TableRow>& rows) {
  std::array<std::set<int>, kLevels.size()> levels;  // degrees and depths in all rows, which share their colours
  for (const TableRow& row : rows)
    for (std::size_t k = 0; k < kLevels.size(); ++k)
      for (const auto& [level, share] : row.figures.*kLevels[k].volume) levels[k].insert(level);
  for (TableRow& row : rows) {
    Session stage(session.registry(), session.console());
    stage.setField({row.field, row.mesh});
    for (std::size_t k = 0; k < kLevels.size(); ++k)
      row.pictures[k] =
          pictureOf(stage.renderer(backend), row, kLevels[k], std::vector(levels[k].begin(), levels[k].end()));
  }
}

std::string gridText(const TableRow& row) {
  const auto& [x, y, z] = row.field.grid();
  return x == y && y == z ? fmt::format("{}³", x) : fmt::format("{}×{}×{}", x, y, z);
}

/// Returns the names and values of the figures of a row, in the order of the paper's table.
std::vector<std::pair<std::string, std::string>> cellsOf(const TableRow& row) {
  const FieldMetadata& metadata = row.field.metadata();
  const bool isMesh = metadata.source.faces > 0;
  const std::optional<double> estimate = row.estimatedRms();
  return {{"mesh", row.name},
          {"vertices", isMesh ? grouped(metadata.source.vertices) : "–"},
          {"faces", isMesh ? grouped(metadata.source.faces) : "–"},
          {"grid", gridText(row)},
          {"time", fmt::format("{:.1f} s", row.seconds)},
          {"cells", grouped(row.figures.leaves) + exactCountText(row.figures)},
          {"τ", estimate ? shortNumber(metadata.settings.targetError.weighted()) : "–"},
          {"memory", bytesText(double(row.figures.bytes))},
          {"weighted estimate (τ)", estimate ? shortNumber(*estimate) : "–"},
          {"measured RMS", shortNumber(row.error.rms / row.scale())},
          {"measured max", shortNumber(row.error.max / row.scale())}};
}

constexpr const char* kErrorsNote =
    "Errors are at the scale where the mesh's longest side is 2; measured ones at random points in the domain. Bars: "
    "shares of the volume by polynomial degree and by depth. Slices: through the middle of the surface, by degree and "
    "by depth.";

std::string markdownOf(const std::vector<TableRow>& rows) {
  std::string head = "|", rule = "|", body;
  for (const TableRow& row : rows) {
    std::string line = "|";
    for (const auto& [name, value] : cellsOf(row)) {
      if (&row == &rows.front()) head += " " + name + " |", rule += name == "mesh" ? "---|" : "--:|";
      line += " " + value + " |";
    }
    body += fmt::format(
        "{0} ![degrees]({1}-degree.svg) | ![depths]({1}-depth.svg) | ![slice by degree]({1}-degree.png) | "
        "![slice by depth]({1}-depth.png) |\n",
        line, row.name);
  }
  return fmt::format(
      "{} degrees | depths | slice by degree | by depth |\n{}---|---|---|---|\n{}\nDegree "
      "![](degree-legend.svg)\nDepth "
      "![](depth-legend.svg)\n\n{}\n",
      head, rule, body, kErrorsNote);
}

Json jsonOf(const TableRow& row) {
  const FieldMetadata& metadata = row.field.metadata();
  const std::optional<double> estimate = row.estimatedRms();
  Json json = {{"mesh", row.mesh},
               {"name", row.name},
               {"vertices", metadata.source.vertices},
               {"faces", metadata.source.faces},
               {"grid", row.field.grid()},
               {"seconds", row.seconds},
               {"leaves", row.figures.leaves},
               {"degree_volume", levelsJson(row.figures.degreeVolume)},
               {"depth_volume", levelsJson(row.figures.depthVolume)},
               {"target_error", estimate ? Json(metadata.settings.targetError.weighted()) : Json()},
               {"tolerance", metadata.settings.tolerance > 0 ? Json(metadata.settings.tolerance) : Json()},
               {"coefficients", row.figures.coefficients},
               {"precision", precisionName(row.field)},
               {"bytes", row.figures.bytes},
               {"estimated_rms", estimate ? Json(*estimate) : Json()},
               {"measured_rms", row.error.rms / row.scale()},
               {"measured_max", row.error.max / row.scale()}};
  if (const Json exact = exactJson(row.figures.exact); !exact.is_null()) json["exact_leaves"] = exact;
  return json;
}

constexpr std::string_view kTableStyle = R"(
body { max-width: none; }
td, th { padding: .4rem .9rem .4rem 0; vertical-align: middle; }
td { overflow-wrap: normal; white-space: nowrap; }
.figure { text-align: right; }
td img { display: block; width: 110px; border-radius: 3px; }
td svg { display: block; margin: .3rem 0; }
.legend { margin: .6rem 0; }
.legend svg { margin-left: .5rem; vertical-align: middle; border-radius: 3px; }
)";

std::string htmlOf(const std::vector<TableRow>& rows) {
  std::string html =
      htmlHead("What hp-adaptive signed distance fields cost",
               fmt::format("{} meshes, as in Table 1 of Koschier, Deul and Bender (2016)", rows.size()), kTableStyle);
  for (std::size_t k = 0; k < kLevels.size(); ++k)
    html +=
        fmt::format("<p class=\"legend\">{} {}</p>\n", kLevels[k].title, levelsSvg(rows.front().pictures[k].colors));
  std::string head;
  for (const auto& [name, value] : cellsOf(rows.front()))
    head += fmt::format("<th{}>{}</th>", name == "mesh" ? "" : " class=\"figure\"", render::escapedMarkup(name));
  html += "<table>\n<tr>" + head + "<th>degrees, depths</th><th>slice by degree</th><th>by depth</th></tr>\n";
  for (const TableRow& row : rows) {
    html += "<tr>";
    for (const auto& [name, value] : cellsOf(row))
      html += fmt::format("<td{}>{}</td>", name == "mesh" ? "" : " class=\"figure\"", render::escapedMarkup(value));
    html += fmt::format("<td>{}{}</td>", row.pictures[0].svg, row.pictures[1].svg);
    for (std::size_t k = 0; k < kLevels.size(); ++k)
      html +=
          fmt::format("<td><img src=\"{}\" alt=\"slice by {}\"></td>", htmlPng(row.pictures[k].png), kLevels[k].name);
    html += "</tr>\n";
  }
  return html + fmt::format("</table>\n<p>{}</p>\n", render::escapedMarkup(kErrorsNote)) + htmlFoot(versionText());
}

std::string textOf(const std::vector<TableRow>& rows) {
  std::string text;
  for (const TableRow& row : rows) {
    text += row.mesh + "\n";
    for (const auto& [name, value] : cellsOf(row))
      if (name != "mesh") text += fmt::format("  {:<16} {}\n", name, value);
  }
  return text;
}

void runTable(Session& session, const Arguments& arguments) {
  const Backend chosen = backend(arguments);
  OutputFolder folder(arguments.text("output"));
  checkWritable(folder.path() / "index.html");
  const std::vector<std::string> names = checkedNames(session, arguments);
  std::vector<TableRow> rows;
  for (std::size_t n = 0; n < names.size(); ++n) rows.push_back(rowOf(session, arguments, n, names[n]));
  drawPictures(session, chosen, rows);

  Json json = {{"points", static_cast<std::uint64_t>(arguments.number("points"))},
               {"seed", static_cast<std::uint64_t>(arguments.number("seed"))},
               {"meshes", Json::array()}};
  for (const TableRow& row : rows) json["meshes"].push_back(jsonOf(row));
  const InterruptGuard guard;  // on Ctrl-C, all files are written or none
  for (std::size_t k = 0; k < kLevels.size(); ++k) {
    for (const TableRow& row : rows) {
      folder.write(fmt::format("{}-{}.png", row.name, kLevels[k].name), row.pictures[k].png);
      folder.write(fmt::format("{}-{}.svg", row.name, kLevels[k].name), row.pictures[k].svg);
    }
    folder.write(fmt::format("{}-legend.svg", kLevels[k].name), levelsSvg(rows.front().pictures[k].colors));
  }
  folder.write("table.md", markdownOf(rows));
  folder.write("table.json", jsonText(json));
  folder.write("index.html", htmlOf(rows));
  folder.commit();
  json["page"] = (folder.path() / "index.html").string();
  if (session.wantsJson(arguments)) return printJson(session.console().out, json);
  session.console().out << textOf(rows) << json["page"].get<std::string>() << "\n";
}

}  // namespace

Study tableStudy() {
  return {
      .name = "table",
      .help = paragraphs(R"(
the paper's Table 1: vertices, faces, base grid, time, cells, degrees and depths as bars, τ, memory, error as estimated
and as measured, slices. target-error, grid and the other options of 'hpsdf build' are given once for all meshes, or
once for each in their order. Writes index.html, one page without network that can be mailed, table.md with its
pictures, and table.json.)"),
      .parameters = joined({samplingParameters(), buildParametersWithout({"max-steps"}), backendParameters()}),
      .run = runTable,
  };
}

}  // namespace hpsdf::app
