#include <fmt/format.h>

#include <chrono>
#include <filesystem>

#include "console/long_work.h"
#include "console/version.h"
#include "construction/build_arguments.h"
#include "construction/build_field.h"
#include "construction/file_kind.h"
#include "construction/mesh_summary.h"
#include "files/html_page.h"
#include "files/output_folder.h"
#include "files/text_file.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/field_file.h"
#include "hpsdf/render/picture.h"
#include "pictures/field_page.h"
#include "pictures/picture_arguments.h"
#include "pictures/picture_commands.h"
#include "session/backend.h"
#include "session/field_argument.h"
#include "session/field_summary.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

/// Returns the renderer's mean time for one frame of the surface, in seconds. The mean is over eight frames, or over as
/// many as fit into two seconds. A first frame is drawn to warm up and is not measured.
double frameSeconds(render::Renderer& renderer, const Field& field, const render::SurfacePicture& picture) {
  using Clock = std::chrono::steady_clock;
  constexpr int kFrames = 8;
  constexpr std::chrono::seconds kEnough(2);
  const render::SurfaceView view{render::cameraOf(picture.camera, field.domain(), picture.width, picture.height), 0};
  renderer.surface(view, picture.width, picture.height);
  const auto start = Clock::now();
  int frames = 0;
  while (frames < kFrames && (frames == 0 || Clock::now() - start < kEnough)) {
    renderer.surface(view, picture.width, picture.height);
    ++frames;
  }
  return secondsSince(start) / frames;
}

struct Drawing {
  std::string_view name, title, caption;
  bool slice;
  render::ColorBy color;
};

using render::ColorBy;
constexpr Drawing kDrawings[] = {
    {"surface", "Surface", "Sphere-traced, lit by the field's own gradient.", false, ColorBy::normal},
    {"degree", "Degree", "The polynomial degree of each cell in the plane through the middle.", true, ColorBy::degree},
    {"depth", "Depth", "How often the octree has halved the base cells, in the same plane.", true, ColorBy::depth},
    {"distance", "Distance", "The signed distance: iso-lines, and the surface as the heavy line where it is zero.",
     true, ColorBy::distance},
    {"surface-degree", "Degree on the surface", "The degree of the cells that hold the surface.", false,
     ColorBy::degree}};

/// Draws a picture into the folder. The result holds the command that draws the same picture from the field's file; the
/// report shows this command.
ReportPicture drawInto(const fs::path& folder, Session& session, render::Renderer& renderer,
                       const std::string& fieldFile, const Drawing& drawing, int samples) {
  const Field& field = session.current().field;
  const std::string file = fmt::format("{}.png", drawing.name);
  std::string command = fmt::format("hpsdf {} {}", drawing.slice ? "slice" : "render", fieldFile);
  if (drawing.color != ColorBy::normal) command += fmt::format(" --color {}", colorName(drawing.color));
  command += " -o " + file;
  render::Image image;
  if (drawing.slice) {
    const render::AxisPlane plane{2, defaultOffset(shownBox(field), 2)};  // the one that `slice` takes by default
    image =
        render::draw(renderer, field, render::SlicePicture{.plane = plane, .color = drawing.color, .samples = samples});
  } else {
    render::SurfacePicture picture;
    picture.color = drawing.color;
    picture.samples = samples;
    image = render::draw(renderer, field, picture);
  }
  if (samples != 1) command += fmt::format(" --samples={}", samples);
  savePng(image, folder / file);
  return {file, std::string(drawing.title), std::string(drawing.caption), command};
}

std::vector<std::pair<std::string, std::string>> figures(const Field& field, const FieldStatistics& counts,
                                                         const BuiltField* built) {
  const FieldMetadata& metadata = field.metadata();
  std::vector<std::pair<std::string, std::string>> rows;
  if (metadata.source.faces > 0)
    rows.emplace_back("Mesh", fmt::format("{}: {} vertices, {} faces", metadata.source.name,
                                          grouped(metadata.source.vertices), grouped(metadata.source.faces)));
  else
    rows.emplace_back("Source", metadata.source.name);
  if (built != nullptr && built->mesh) rows.emplace_back("Surface", closednessText(*built->mesh));
  if (metadata.source.insideTest != InsideTest::automatic)
    rows.emplace_back("Sign by", insideTestName(metadata.source.insideTest));
  rows.emplace_back("Leaf cells", grouped(counts.leaves) + exactCountText(counts));
  rows.emplace_back("Coefficients", fmt::format("{} ({})", grouped(counts.coefficients), precisionName(field)));
  if (counts.exact.leaves > 0) rows.emplace_back("Exact triangles", exactTrianglesText(counts.exact));
  rows.emplace_back("Memory", memoryText(field));
  if (hasTolerance(field)) {
    rows.emplace_back("Tolerance", toleranceText(field));
  } else if (metadata.hasEstimate()) {
    rows.emplace_back("Target error τ", shortNumber(metadata.settings.targetError.weighted()));
    rows.emplace_back("Total error ε",
                      fmt::format("{}, nearness {}", shortNumber(metadata.totalError), metadata.settings.nearness));
  }
  if (const std::optional<Measurement>& m = metadata.measurement) {
    const auto row = [&](const char* label, const Measurement::Error& error) {
      const double side = metadata.referenceLength;
      rows.emplace_back(label, fmt::format("{}; over the longest side: {}", errorText(error),
                                           errorText({.rms = error.rms / side, .max = error.max / side})));
    };
    row("Error near the surface", m->near);
    row("Error over the domain", m->domain);
    rows.emplace_back("Wrong signs", wrongSignsText(*m));
    rows.emplace_back("Torn", tornText(*m));
  }
  rows.emplace_back("Exact distances taken", grouped(metadata.exactEvaluations));
  if (built != nullptr) rows.emplace_back("Construction", fmt::format("{:.1f} s", built->seconds));
  return rows;
}

constexpr const char* kExplorerFile = "explorer.html";

/// Writes the page of the current field into the folder, so that the report shows the field live. Returns false for a
/// field that pages cannot show.
bool writeExplorer(Session& session, render::Renderer& renderer, const fs::path& folder) {
  const Field& field = session.current().field;
  const std::string name = plainName(session.current().name);
  if (const std::string reason = refusal(field); !reason.empty()) {
    note(session.console(), fmt::format("the report shows the field by pictures alone: it {}", reason));
    return false;
  }
  FieldPage page;
  const FieldInPage described{.name = name, .pictures = fallbackPictures(renderer, field, name)};
  withProgress(session.console(), [&](const Progress& progress) {
    page.add(field, described, progress);
    return true;
  });
  writeTextFile(folder / kExplorerFile, page.html(name));
  return true;
}

void runReport(Session& session, const Arguments& arguments) {
  const Console& console = session.console();
  const Backend chosen = backend(arguments);
  OutputFolder folder(arguments.text("output"));
  checkWritable(folder.path() / "index.html");
  std::optional<BuiltField> built;
  if (arguments.has("source") && kindOfFile(arguments.text("source")) != FileKind::field) {
    built = buildField(console, arguments.text("source"), arguments);
    session.setField({std::move(built->field), arguments.text("source")});
  } else if (arguments.has("source")) {
    loadField(session, arguments.text("source"));
  }
  const CurrentField& current = session.current();
  const Field& field = current.field;
  render::Renderer& renderer = session.renderer(chosen);
  const std::string fieldFile = plainName(current.name) + ".hpsdf";
  folder.keep();
  save(field, folder.path() / fieldFile);

  const FieldStatistics counts = statistics(field);
  const bool isLive = writeExplorer(session, renderer, folder.path());
  ReportPage page{.title = fmt::format("{} as an hp-adaptive signed distance field", plainName(current.name)),
                  .subtitle = fmt::format("{} leaf cells{}, {}, {}", grouped(counts.leaves), exactCountText(counts),
                                          bytesText(double(counts.bytes)), measuredText(field)),
                  .explorer = isLive ? kExplorerFile : "",
                  .figures = figures(field, counts, built ? &*built : nullptr),
                  .degrees = counts.degreeVolume,
                  .depths = counts.depthVolume,
                  .buildCommand = built ? buildCommandLine(arguments.text("source"), fieldFile, arguments) : "",
                  .footer = fmt::format("{}; {}", versionText(), renderer.description())};
  for (const Drawing& drawing : kDrawings)
    page.pictures.push_back(drawInto(folder.path(), session, renderer, fieldFile, drawing, arguments.whole("samples")));
  const render::SurfacePicture traced;  // the timed frame has one sample per pixel
  const double seconds = frameSeconds(renderer, field, traced);
  page.figures.emplace_back("Traced frame", fmt::format("{:.3f} s for {}x{}, one sample a pixel, field resident",
                                                        seconds, traced.width, traced.height));
  page.figures.emplace_back("Renderer", renderer.description());

  const fs::path index = folder.path() / "index.html";
  writeTextFile(index, reportHtml(page));
  if (session.wantsJson(arguments)) {
    Json files = Json::array();
    for (const ReportPicture& picture : page.pictures) files.push_back((folder.path() / picture.file).string());
    return printJson(console.out, {{"page", index.string()},
                                   {"field_file", (folder.path() / fieldFile).string()},
                                   {"explorer", isLive ? Json((folder.path() / kExplorerFile).string()) : Json()},
                                   {"pictures", files},
                                   {"build_seconds", built ? Json(built->seconds) : Json()},
                                   {"frame_seconds", seconds},
                                   {"renderer", renderer.description()},
                                   {"field", fieldJson(current)}});
  }
  console.out << fmt::format("{}\ntraced frame {:.3f} s, {}\n{}\n", fieldLine(field), seconds, renderer.description(),
                             index.string());
}

}  // namespace

void addReportCommand(Registry& registry) {
  registry.add({
      .name = "report",
      .summary = "Write one offline page: a field to turn and slice, its pictures and its figures.",
      .help =
          "SOURCE is a field's file (*.hpsdf) or anything that 'hpsdf build' takes, with the same options. The folder "
          "receives index.html, its pictures, each with the command that makes it, the field itself, and "
          "explorer.html: "
          "the page of 'hpsdf page', which index.html shows on top, so that the field can be turned and sliced there.",
      .examples = {"hpsdf report bunny.hpsdf -o report", "hpsdf report builtin:torus -o torus --target-error 1e-7"},
      .parameters =
          joined({{{"source", text("SOURCE").positional().requiredOnCommandLine(),
                    "A field's file, a mesh or a shape; in a script, the current field when left out."},
                   {"output", outputFile("FOLDER").as('o').required(), "The folder; made when it is not there."},
                   {"samples", wholeNumber().within(1, 8).byDefault("2").under(kPicture),
                    "Samples a pixel of the pictures along each axis; the timed frame has one."}},
                  buildParameters(),
                  backendParameters()}),
      .action = runReport,
  });
}

}  // namespace hpsdf::app
