// `study table`: time, memory and errors of the fields of given meshes (paper, Table 1).

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <set>

#include "console/interrupt.h"
#include "console/long_work.h"
#include "console/version.h"
#include "construction/build_field.h"
#include "files/html_page.h"
#include "files/output_folder.h"
#include "files/text_file.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/render/picture.h"
#include "hpsdf/verify.h"
#include "language/script.h"
#include "pictures/picture_arguments.h"
#include "session/backend.h"
#include "session/session.h"
#include "study/study.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

constexpr int kThumbnail = 200;  // side of a slice, pixels
constexpr int kBar = 300;        // length of a bar, which shows the whole volume, pixels

/// A mesh and its field.
struct TableRow {
  std::string mesh;
  std::string name;  ///< name for files
  Field field;
  FieldStatistics figures;
  double seconds;      ///< of the construction
  ErrorFigures error;  ///< measured, in the field's units

  double scale() const { return field.metadata().referenceLength / 2; }
  double estimatedRms() const { return field.metadata().rmsEstimate(field.domain()) / scale(); }
};

using Shares = std::map<int, double>;
using Colors = std::map<int, render::Color>;

TableRow rowOf(Session& session, const Arguments& arguments, std::size_t mesh, const std::string& name) {
  const std::string surface = arguments.texts("mesh")[mesh];
  const Arguments buildArgs = buildArguments(session, arguments, mesh);
  BuiltField built = buildField(session.console(), surface, buildArgs);
  const SampleOptions sampling = sampleOptions(arguments, buildArgs.whole("threads"));
  const ExactSamples samples = withProgress(session.console(), [&](const Progress& progress) {
    return sampleUniform(*built.exact, built.field.domain(), 0, sampling, progress);
  });
  ErrorFigures error = measureError(built.field, samples, sampling.threads);
  FieldStatistics figures = statistics(built.field);
  return {surface, name, std::move(built.field), std::move(figures), built.seconds, std::move(error)};
}

const Shares& sharesOf(const TableRow& row, render::ColorBy color) {
  return color == render::ColorBy::degree ? row.figures.degreeVolume : row.figures.depthVolume;
}

/// The levels of all rows, so that a colour has the same meaning in every picture.
std::vector<int> levelsOf(const std::vector<TableRow>& rows, render::ColorBy color) {
  std::set<int> levels;
  for (const TableRow& row : rows)
    for (const auto& [level, share] : sharesOf(row, color)) levels.insert(level);
  return {levels.begin(), levels.end()};
}

/// A slice through the middle of the domain, with the levels that its colours show.
struct Thumbnail {
  std::string png;  ///< bytes of the PNG file
  Colors colors;
};

Thumbnail thumbnailOf(render::Renderer& renderer, const TableRow& row, render::ColorBy color,
                      const std::vector<int>& levels) {
  const render::SlicePicture picture{.plane = render::AxisPlane{2, defaultOffset(row.field.domain(), 2)},
                                     .color = color,
                                     .width = kThumbnail,
                                     .height = kThumbnail,
                                     .samples = 2,
                                     .scale = {.levels = levels},
                                     .bare = true};
  const render::Drawn drawn = render::drawSlice(renderer, row.field, picture);
  const TemporaryFolder folder;
  savePng(drawn.image, folder.path() / "slice.png");
  Thumbnail thumbnail{readWholeFile((folder.path() / "slice.png").string()), {}};
  for (const render::Legend::Level& level : drawn.legend.levels) thumbnail.colors[level.level] = level.color;
  return thumbnail;
}

std::string cssColor(const render::Color& color) {
  return fmt::format("#{:02x}{:02x}{:02x}", color[0], color[1], color[2]);
}

constexpr int kShareBarHeight = 18;

/// An SVG picture of that width with the given elements.
std::string rowSvg(int width, const std::string& parts) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"DejaVu Sans, sans-serif\" font-size=\"11\" text-anchor=\"middle\">{2}</svg>",
      width, kShareBarHeight, parts);
}

/// A rectangle in a level's colour. It contains the level's number if there is room.
std::string partSvg(double from, double width, int level, const render::Color& color, const std::string& title) {
  std::string svg =
      fmt::format("<rect x=\"{:.2f}\" y=\"0\" width=\"{:.2f}\" height=\"{}\" fill=\"{}\"><title>{}</title></rect>",
                  from, width, kShareBarHeight, cssColor(color), title);
  const bool isLight = 0.3 * color[0] + 0.6 * color[1] + 0.1 * color[2] > 128;
  if (width > 12)
    svg += fmt::format("<text x=\"{:.2f}\" y=\"13\" fill=\"{}\">{}</text>", from + width / 2,
                       isLight ? "#000000" : "#ffffff", level);
  return svg;
}

/// A bar that shows the shares of the volume.
std::string barSvg(const Shares& shares, const Colors& colors) {
  std::string parts;
  double from = 0;
  for (const auto& [level, share] : shares) {
    parts +=
        partSvg(kBar * from, kBar * share, level, colors.at(level), fmt::format("{}: {:.2f} %", level, 100 * share));
    from += share;
  }
  return rowSvg(kBar, parts);
}

/// The key to the colours of all levels.
std::string legendSvg(const Colors& colors) {
  constexpr int kWidth = 26;
  std::string parts;
  int from = 0;
  for (const auto& [level, color] : colors) {
    parts += partSvg(from, kWidth, level, color, std::to_string(level));
    from += kWidth;
  }
  return rowSvg(from, parts);
}

/// The pictures of a row.
struct RowPictures {
  Thumbnail degree, depth;

  std::string degreeBar(const TableRow& row) const { return barSvg(row.figures.degreeVolume, degree.colors); }
  std::string depthBar(const TableRow& row) const { return barSvg(row.figures.depthVolume, depth.colors); }
};

std::vector<RowPictures> picturesOf(Session& session, const Backend& backend, std::vector<TableRow>& rows) {
  using enum render::ColorBy;
  const std::vector<int> degrees = levelsOf(rows, degree), depths = levelsOf(rows, depth);
  std::vector<RowPictures> pictures;
  for (TableRow& row : rows) {
    Session stage(session.registry(), session.console());
    stage.setField({row.field, row.mesh});
    render::Renderer& renderer = stage.renderer(backend);
    pictures.push_back({thumbnailOf(renderer, row, degree, degrees), thumbnailOf(renderer, row, depth, depths)});
  }
  return pictures;
}

std::string gridText(const TableRow& row) {
  const auto& [x, y, z] = row.field.grid();
  return x == y && y == z ? fmt::format("{}³", x) : fmt::format("{}×{}×{}", x, y, z);
}

/// The names and values of a row's figures, in the order of the paper's table.
std::vector<std::pair<std::string, std::string>> cellsOf(const TableRow& row) {
  const FieldMetadata& metadata = row.field.metadata();
  const bool isMesh = metadata.source.faces > 0;
  return {{"mesh", row.name},
          {"vertices", isMesh ? grouped(metadata.source.vertices) : "–"},
          {"faces", isMesh ? grouped(metadata.source.faces) : "–"},
          {"grid", gridText(row)},
          {"time", fmt::format("{:.1f} s", row.seconds)},
          {"cells", grouped(row.figures.leaves)},
          {"τ", shortNumber(metadata.settings.targetError.weighted())},
          {"memory", bytesText(double(row.figures.bytes))},
          {"estimated RMS", shortNumber(row.estimatedRms())},
          {"measured RMS", shortNumber(row.error.rms / row.scale())},
          {"measured max", shortNumber(row.error.max / row.scale())}};
}

constexpr const char* kDegreeLegend = "degree-legend.svg";
constexpr const char* kDepthLegend = "depth-legend.svg";
constexpr const char* kErrorsNote =
    "Errors are at the scale where the mesh's longest side is 2; measured ones at random points in the domain. Bars: "
    "shares of the volume by polynomial degree and by depth. Slices: through the middle, by degree and by depth.";

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
      "{} degrees | depths | slice by degree | by depth |\n{}---|---|---|---|\n{}\nDegree ![]({})\nDepth "
      "![]({})\n\n{}\n",
      head, rule, body, kDegreeLegend, kDepthLegend, kErrorsNote);
}

Json levelsJson(const Shares& shares) {
  Json json = Json::object();
  for (const auto& [level, share] : shares) json[std::to_string(level)] = share;
  return json;
}

Json jsonOf(const TableRow& row) {
  const FieldMetadata& metadata = row.field.metadata();
  return {{"mesh", row.mesh},
          {"name", row.name},
          {"vertices", metadata.source.vertices},
          {"faces", metadata.source.faces},
          {"grid", row.field.grid()},
          {"seconds", row.seconds},
          {"leaves", row.figures.leaves},
          {"degree_volume", levelsJson(row.figures.degreeVolume)},
          {"depth_volume", levelsJson(row.figures.depthVolume)},
          {"target_error", metadata.settings.targetError.weighted()},
          {"coefficients", row.figures.coefficients},
          {"precision", row.field.singlePrecision() ? "float" : "double"},
          {"bytes", row.figures.bytes},
          {"estimated_rms", row.estimatedRms()},
          {"measured_rms", row.error.rms / row.scale()},
          {"measured_max", row.error.max / row.scale()}};
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

std::string legendHtml(const std::string& title, const Colors& colors) {
  return fmt::format("<p class=\"legend\">{} {}</p>\n", title, legendSvg(colors));
}

std::string htmlOf(const std::vector<TableRow>& rows, const std::vector<RowPictures>& pictures) {
  std::string html =
      htmlHead("What hp-adaptive signed distance fields cost",
               fmt::format("{} meshes, as in Table 1 of Koschier, Deul and Bender (2016)", rows.size()), kTableStyle);
  html += legendHtml("Degree", pictures.front().degree.colors) + legendHtml("Depth", pictures.front().depth.colors);
  const auto addCells = [&](const char* tag, const TableRow& row, bool names) {
    for (const auto& [name, value] : cellsOf(row))
      html += fmt::format("<{0}{1}>{2}</{0}>", tag, name == "mesh" ? "" : " class=\"figure\"",
                          htmlEscaped(names ? name : value));
  };
  html += "<table>\n<tr>";
  addCells("th", rows.front(), true);
  html += "<th>degrees, depths</th><th>slice by degree</th><th>by depth</th></tr>\n";
  for (std::size_t n = 0; n < rows.size(); ++n) {
    html += "<tr>";
    addCells("td", rows[n], false);
    html += fmt::format(
        "<td>{}{}</td><td><img src=\"{}\" alt=\"slice by degree\"></td><td><img src=\"{}\" alt=\"slice "
        "by depth\"></td></tr>\n",
        pictures[n].degreeBar(rows[n]), pictures[n].depthBar(rows[n]), htmlPng(pictures[n].degree.png),
        htmlPng(pictures[n].depth.png));
  }
  return html + fmt::format("</table>\n<p>{}</p>\n", htmlEscaped(kErrorsNote)) + htmlFoot(versionText());
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
  const std::vector<std::string> meshes = arguments.texts("mesh");
  const std::vector<std::string> names = fileNames(meshes);
  for (std::size_t n = 0; n < meshes.size(); ++n)
    buildArguments(session, arguments, n);  // reports mistakes before the long work
  std::vector<TableRow> rows;
  for (std::size_t n = 0; n < meshes.size(); ++n) rows.push_back(rowOf(session, arguments, n, names[n]));
  const std::vector<RowPictures> pictures = picturesOf(session, chosen, rows);

  Json json = {{"points", static_cast<std::uint64_t>(arguments.number("points"))},
               {"seed", static_cast<std::uint64_t>(arguments.number("seed"))},
               {"meshes", Json::array()}};
  for (const TableRow& row : rows) json["meshes"].push_back(jsonOf(row));
  const InterruptGuard guard;  // Ctrl-C must not interrupt the writing of the files
  for (std::size_t n = 0; n < rows.size(); ++n) {
    folder.write(names[n] + "-degree.png", pictures[n].degree.png);
    folder.write(names[n] + "-depth.png", pictures[n].depth.png);
    folder.write(names[n] + "-degree.svg", pictures[n].degreeBar(rows[n]));
    folder.write(names[n] + "-depth.svg", pictures[n].depthBar(rows[n]));
  }
  folder.write(kDegreeLegend, legendSvg(pictures.front().degree.colors));
  folder.write(kDepthLegend, legendSvg(pictures.front().depth.colors));
  folder.write("table.md", markdownOf(rows));
  folder.write("table.json", json.dump(2) + "\n");
  folder.write("index.html", htmlOf(rows, pictures));
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
