#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "commands/commands.h"
#include "console/interrupt.h"
#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "construction/file_kind.h"
#include "construction/reference_surface.h"
#include "construction/surface.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/output/sample_file.h"
#include "hpsdf/output/sample_points.h"
#include "session/field_argument.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr double kMostPoints = 4294967295;

SampleFileOptions sampleFileOptions(const Arguments& arguments) {
  return {.layout = arguments.text("layout") == "deepsdf" ? SampleLayout::deepSdf : SampleLayout::arrays,
          .doubles = arguments.flag("double")};
}

void checkSample(const Arguments& arguments) {
  checkSamplesWritable(arguments.text("output"), sampleFileOptions(arguments));
  insideOptions(arguments);
}

std::size_t countFrom(const Arguments& arguments, const char* kind) {
  return static_cast<std::size_t>(arguments.number(kind));
}

SamplePointsOptions sampleOptions(const Arguments& arguments) {
  SamplePointsOptions options{
      .surface = countFrom(arguments, "surface"),
      .edge = countFrom(arguments, "edge"),
      .near = countFrom(arguments, "near"),
      .uniform = countFrom(arguments, "uniform"),
      .sharpAngleDegrees = arguments.number("sharp-angle"),
      .enlargement = arguments.number("enlargement"),
      .floatPoints = !arguments.flag("double"),
      .seed = static_cast<std::uint64_t>(arguments.number("seed")),
      .threads = arguments.whole("threads"),
  };
  // DeepSDF trains on no points of the surface itself.
  if (arguments.text("layout") == "deepsdf" && !arguments.given("surface")) options.surface = 0;
  if (arguments.given("widths")) {
    const std::vector<double> widths = arguments.numbers("widths");
    options.widths = {widths.front(), widths.back()};
  }
  return options;
}

/// The samples of a surface, and how the surface was moved before.
struct MadeSamples {
  SamplePoints samples;
  Normalization normalization = {};
  double seconds = 0;
};

/// Returns the normalization by which DeepSDF moves a mesh into the unit sphere: its box is centred, and its farthest
/// vertex comes to lie at 1/1.03.
Normalization toUnitSphere(const TriangleMesh& mesh) {
  constexpr double kBeyondMesh = 1.03;
  const Vector3 center = boundingBox(mesh).center();
  double radius = 0;
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle) radius = std::max(radius, (mesh.vertices[vertex] - center).norm());
  if (!(radius > 0)) throw Error("the mesh has no extent; give a mesh with faces");
  return {center, 1 / (kBeyondMesh * radius)};
}

MadeSamples samplesOfMesh(const Console& console, const std::string& surface, const Arguments& arguments) {
  return namingSurface(surface, [&] {
    requireMesh(surface);
    PreparedSurface prepared = prepareSurface(console, surface, false);
    MadeSamples made;
    if (arguments.flag("unit-sphere")) {
      made.normalization = prepared.normalization = toUnitSphere(prepared.mesh);
      for (Vector3& vertex : prepared.mesh.vertices)
        vertex = made.normalization.scale * (vertex - made.normalization.center);
    }
    const auto distance = distanceToMesh(console, surface, prepared, insideOptions(arguments));
    made.samples = withProgress(console, [&](const Progress& progress) {
      return samplePoints(prepared.mesh, *distance, sampleOptions(arguments), progress);
    });
    return made;
  });
}

/// Returns the samples of a field on the given mesh or, without one, on the field's contour.
SamplePoints drawnFromField(const Console& console, const Field& field, const Arguments& arguments) {
  const SamplePointsOptions options = sampleOptions(arguments);
  const auto draw = [&](const auto&... surface) {
    return withProgress(console,
                        [&](const Progress& progress) { return samplePoints(surface..., field, options, progress); });
  };
  if (!arguments.has("mesh")) return draw();
  const std::string surface = arguments.text("mesh");
  const bool normalizes = !field.metadata().source.normalization.isIdentity();
  return namingSurface(surface, [&] {
    requireMesh(surface);
    return draw(prepareSurface(console, surface, normalizes).mesh);
  });
}

MadeSamples samplesOfField(const Session& session, const Arguments& arguments) {
  for (const char* option : {"sign", "hull", "thickness", "unit-sphere"})
    if (arguments.given(option))
      throw Error(fmt::format("{}: applies to meshes only: leave it out for a field", option));
  return {.samples = drawnFromField(session.console(), session.current().field, arguments)};
}

MadeSamples makeSamples(Session& session, const Arguments& arguments) {
  const std::string source = arguments.textOr("source", "");
  const FileKind kind = source.empty() ? FileKind::field : kindOfFile(source);
  if (kind == FileKind::unknown) {
    if (std::filesystem::exists(source)) throw unknownKind(source);
    throw Error(ErrorKind::file, source, "no such file; give a mesh, a shape or a field");
  }
  if (kind == FileKind::surface) {
    if (arguments.has("mesh")) throw Error(source + ": this is a mesh or a shape; give the field first, then the mesh");
    return samplesOfMesh(session.console(), source, arguments);
  }
  if (source.empty() && !session.hasField()) throw Error("sample: source is missing; 'hpsdf help sample' explains");
  if (!source.empty()) loadField(session, source);
  return samplesOfField(session, arguments);
}

std::size_t countOfKind(const SamplePoints& samples, PointKind kind) {
  return static_cast<std::size_t>(std::ranges::count(samples.kinds, kind));
}

std::size_t countInside(const SamplePoints& samples) {
  return static_cast<std::size_t>(std::ranges::count_if(samples.distances, [](double d) { return d < 0; }));
}

Json samplesJson(const MadeSamples& made, const std::string& file) {
  return {{"output", file},
          {"file_bytes", std::filesystem::file_size(file)},
          {"points", made.samples.size()},
          {"surface", countOfKind(made.samples, PointKind::surface)},
          {"edge", countOfKind(made.samples, PointKind::edge)},
          {"near", countOfKind(made.samples, PointKind::near)},
          {"uniform", countOfKind(made.samples, PointKind::uniform)},
          {"inside", countInside(made.samples)},
          {"center", vectorJson(made.normalization.center)},
          {"scale", made.normalization.scale},
          {"seconds", made.seconds}};
}

std::string samplesText(const MadeSamples& made, const std::string& file) {
  const SamplePoints& samples = made.samples;
  std::string text = fmt::format("{}: {} points, {} in {:.1f} s\n", file, grouped(samples.size()),
                                 bytesText(static_cast<double>(std::filesystem::file_size(file))), made.seconds);
  text += summaryRow(
      "kinds",
      fmt::format("{} on the surface, {} on sharp edges, {} near it, {} uniform",
                  grouped(countOfKind(samples, PointKind::surface)), grouped(countOfKind(samples, PointKind::edge)),
                  grouped(countOfKind(samples, PointKind::near)), grouped(countOfKind(samples, PointKind::uniform))));
  text += summaryRow("inside", grouped(countInside(samples)) + " points with a distance below 0");
  if (!made.normalization.isIdentity())
    text += summaryRow("unit sphere", fmt::format("points are {} · (x − c) of the mesh's x, with c = {},{},{}",
                                                  made.normalization.scale, made.normalization.center.x(),
                                                  made.normalization.center.y(), made.normalization.center.z()));
  return text;
}

void runSample(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  const InterruptGuard guard;  // on Ctrl-C, the file is written completely or not at all
  const auto start = std::chrono::steady_clock::now();
  MadeSamples made = makeSamples(session, arguments);
  withThreads(arguments.whole("threads"), [&] { saveSamples(made.samples, file, sampleFileOptions(arguments)); });
  made.seconds = secondsSince(start);
  std::ostream& result = session.console().out;
  if (session.wantsJson(arguments)) return printJson(result, samplesJson(made, file));
  result << samplesText(made, file);
}

/// Returns the parameter `seed`, which all help texts show: two seeds make a training and a test set.
Parameter seedOfSamples() {
  Parameter seed = seedParameter("Seed of the random numbers: another seed gives other points.");
  seed.isAdvanced = false;
  return seed;
}

const std::vector<Parameter> kSampleParameters = {
    {"source", text("MESH|FIELD").positional(),
     "Mesh file or builtin:SHAPE, whose exact distances are computed, or the file of a field. A script may leave it "
     "out "
     "and samples the current field then."},
    {"mesh", text("MESH").positional(),
     "Mesh on which the points of a field are drawn, in place of the field's contour; usually the one from which the "
     "field was made."},
    {"output", outputFile().as('o').required().under(kFiles),
     "File of the samples: *.npz, arrays for NumPy; *.ply, a cloud of points for viewers; or *.csv, a table."},
    {"layout", choice({"arrays", "deepsdf"}).byDefault("arrays").under(kFiles),
     "Arrays of a .npz file: points, distances, gradients, closest, faces, normals and kinds; or those that DeepSDF's "
     "training reads, pos and neg, of four columns x, y, z and distance."},
    {"double", flag().under(kFiles),
     "Write numbers in double precision. By default they are floats: points are rounded first, so that distances are "
     "those of the points in the file."},
    {"surface", wholeNumber().within(0, kMostPoints).byDefault("250000"),
     "Number of points on the surface, uniform by area. With the layout deepsdf it is 0 unless it is given."},
    {"edge", wholeNumber().within(0, kMostPoints).byDefault("0"),
     "Number of points on the sharp edges of the surface, uniform by length."},
    {"near", wholeNumber().within(0, kMostPoints).byDefault("470000"),
     "Number of points near the surface: points of the surface that are moved by Gaussian noise."},
    {"uniform", wholeNumber().within(0, kMostPoints).byDefault("30000"),
     "Number of points in the box around the surface."},
    {"widths", numbers("W|W,W", {1, 2}).above(0).in("radii"),
     "Standard deviations of the noise, of which near points take the one and the other in turn, as shares of the "
     "surface's radius about the centre of its box. The default is √0.005 and √0.0005, as DeepSDF's program has it."},
    {"sharp-angle", number().within(0, 180).byDefault("30").in("degrees"),
     "Least angle between the normals of two faces at a sharp edge. Boundary edges are sharp, too."},
    {"enlargement", number().atLeast(0).byDefault("0.1"),
     "Width by which the box of uniform points is larger than the surface's box on each side, as a share of the "
     "longest "
     "side."},
    {"unit-sphere", flag(),
     "Move and scale the mesh into the unit sphere first, as DeepSDF does: its box is centred, and its farthest vertex "
     "is at 1/1.03."}};

}  // namespace

void addSampleCommand(Registry& registry) {
  registry.add({
      .name = "sample",
      .summary = "Write random points with signed distances, to train and test learned distance functions.",
      .help = paragraphs(R"(
Draws points on the surface, on its sharp edges, near it and around it, and writes for each the signed distance, its gradient,
the closest point of the surface, the face on which that lies with its normal, and the kind of the point: 0 on the surface, 1
on an edge, 2 near, 3 uniform. Distances are negative inside and exact. The points of a kind follow each other and are in
random order, so that any part of them is a sample, too.

For a field, distances and gradients are the field's, and there are no closest points, faces and normals.

Use it to make training data: signs are right for meshes with holes and overlaps, too, and gradients and normals suit losses
that compare slopes. Points depend on the seed only, not on the number of threads: two seeds give independent sets for training
and for testing. A million points of a mesh of 70,000 faces take about half a second on two cores.

docs/samples.md lists the arrays with their shapes and shows how to read them.)"),
      .examples = {"hpsdf sample bunny.obj -o bunny.npz", "hpsdf sample part.stl -o part.npz --edge 100000 --seed 7",
                   "hpsdf sample chair.obj -o chair.npz --layout deepsdf --unit-sphere",
                   "hpsdf sample bunny.hpsdf -o cloud.ply --near 0 --uniform 100000"},
      .parameters = joined({kSampleParameters,
                            under("The surface", insideParameters()),
                            {seedOfSamples(), threadsParameter("The file is")}}),
      .action = runSample,
      .check = checkSample,
  });
}

}  // namespace hpsdf::app
