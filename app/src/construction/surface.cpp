#include "construction/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "console/long_work.h"
#include "construction/mesh_process.h"
#include "construction/mesh_summary.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/text.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/shapes.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Memory that a process takes up to and while it sets up an exact distance function, in bytes per mesh face: a quarter
/// more than was measured at 1.1M faces, with signs by winding number. kBytesPerHullFace applies if the inside
/// test is the outer hull. Up to 250,000 pieces of intersected faces then need additional memory, which is not counted
/// here.
constexpr double kBytesPerFace = 400, kBytesPerHullFace = 620;

/// A distance in the units of a normalized surface.
struct NormalizedDistance {
  DistanceFunction distance;
  Normalization to;

  std::vector<Vector3> original(std::span<const Vector3> points) const {
    std::vector<Vector3> original(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) original[i] = points[i] / to.scale + to.center;
    return original;
  }
  void operator()(std::span<const Vector3> points, std::span<double> out) const {
    distance(original(points), out);
    for (double& value : out) value *= to.scale;
  }
  bool hasGradients() const { return distance.hasGradients(); }
  void withGradients(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> gradients) const {
    distance.withGradients(original(points), out, gradients);
    for (double& value : out) value *= to.scale;
  }
  std::size_t bytes() const { return distance.bytes(); }
};

/// Throws `Error` for a file of a format that `hpsdf export` writes and no command reads.
void refuseWrittenOnly(const std::string& file) {
  constexpr std::array kWrittenOnly = {".vtu", ".nvdb", ".cdf"};
  const std::string extension = lowerExtension(file);
  if (std::ranges::find(kWrittenOnly, extension) != kWrittenOnly.end())
    throw Error(
        ErrorKind::file, file,
        "hpsdf writes " + extension + " files, but reads none; the grids that it reads are .vdb, .vti and .npy");
}

ImportedMesh readFile(const Console& console, const std::string& file) {
  return withProgress(console, [&](const Progress& progress) {
    if (console.meshReader.empty() || !isReadByOthers(file)) return importMesh(file, progress);
    return importInSubprocess(console.meshReader, file, readingLimits(file), progress);
  });
}

/// Returns a surface that has no mesh, an analytic shape or a grid. Returns std::nullopt for other surfaces.
std::optional<PreparedSurface> surfaceWithoutMesh(const Console& console, const std::string& surface,
                                                  const GridPlacement& placement) {
  PreparedSurface prepared;
  if (surface.starts_with(kAnalytic)) {
    prepared.function = shapes::analytic(surface);
  } else if (isGridName(surface)) {
    GridDistance grid = readGridSurface(console, surface, placement);
    prepared.samples = grid.domain();
    prepared.function = DistanceFunction(std::move(grid));
  } else {
    if (placement.isGiven()) throw Error("spacing and origin belong to an array of NumPy (.npy): leave them out");
    return std::nullopt;
  }
  return prepared;
}

/// Returns where a normalization takes a box.
Box normalizedBox(const Box& box, const Normalization& to) {
  if (box.isEmpty()) return box;
  return Box(to.scale * (box.min() - to.center), to.scale * (box.max() - to.center));
}

/// Reports which inside test (method to tell inside from outside) was chosen. A closed mesh without self-intersections
/// needs no report. The position in `choice` is in units of the normalized mesh. Positions in `report` are in units of
/// the file.
void tellInsideTest(const Console& console, const std::string& surface, const MeshReport& report,
                    InsideTestChoice choice, const Normalization& normalization) {
  if (choice.position) choice.position = *choice.position / normalization.scale + normalization.center;
  if (!choice.reason.empty() && choice.insideTest != InsideTest::pseudonormal)
    note(console, fmt::format("{}: sign by winding number: {}", surface, reasonText(choice, report.box)));
  if (choice.reason.empty() && choice.insideTest == InsideTest::pseudonormal && !report.closed())
    warn(
        console,
        fmt::format("{}: the surface is not closed ({}): by pseudonormals signs may be wrong, and refinement may chase "
                    "their jumps without end; --sign auto closes the holes, and a lower max-depth bounds refinement",
                    surface, faultyEdges(report)));
}

}  // namespace

DistanceFunction normalizedFunction(const DistanceFunction& distance) {
  const Normalization to = normalizationOf(distance.source().box);
  Source source = distance.source();
  source.box = normalizedBox(source.box, to);
  source.normalization = to;
  return DistanceFunction(NormalizedDistance{distance, to}, source);
}

bool isShape(std::string_view surface) { return surface.starts_with(kBuiltin) || surface.starts_with(kAnalytic); }

void requireMesh(const std::string& surface) {
  if (surface.starts_with(kAnalytic))
    throw Error(ErrorKind::mesh, surface,
                "an analytic shape has no mesh; take builtin:" + surface.substr(kAnalytic.size()));
  if (isGridName(surface))
    throw Error(ErrorKind::mesh, surface,
                "a grid has no mesh; 'hpsdf build' makes a field from it, and 'hpsdf contour' a mesh from that");
}

ImportedMesh importSurface(const Console& console, const std::string& surface) {
  if (console.meshes != nullptr)
    if (const auto found = console.meshes->find(surface); found != console.meshes->end())
      return {found->second, inspect(found->second)};
  requireMesh(surface);
  refuseWrittenOnly(surface);
  if (surface.starts_with(kBuiltin)) {
    TriangleMesh mesh = shapes::mesh(surface);
    const MeshReport report = inspect(mesh);
    return {std::move(mesh), report};
  }
  return readFile(console, surface);
}

PreparedSurface prepareSurface(const Console& console, const std::string& surface, bool normalizes,
                               const GridPlacement& placement) {
  if (std::optional<PreparedSurface> known = surfaceWithoutMesh(console, surface, placement)) {
    if (!normalizes) return *std::move(known);
    known->function = normalizedFunction(*known->function);
    known->samples = normalizedBox(known->samples, known->function->source().normalization);
    return *std::move(known);
  }
  PreparedSurface prepared;
  ImportedMesh imported = importSurface(console, surface);
  prepared.report = imported.report;
  if (normalizes) prepared.normalization = normalizationOf(boundingBox(imported.mesh));
  prepared.mesh = normalizes ? normalized(imported.mesh) : std::move(imported.mesh);
  return prepared;
}

void requireDistanceMemory(const TriangleMesh& mesh, InsideTest insideTest) {
  const double bytesPerFace = insideTest == InsideTest::outerHull ? kBytesPerHullFace : kBytesPerFace;
  requireMemory("the exact distance of " + grouped(mesh.triangles.size()) + " faces",
                bytesPerFace * double(mesh.triangles.size()), "simplify the mesh first");
}

std::shared_ptr<const ExactDistance> distanceTo(const Console& console, const TriangleMesh& mesh,
                                                const DistanceOptions& options) {
  requireDistanceMemory(mesh, options.insideTest);
  return withProgress(console, [&](const Progress& progress) {
    return std::make_shared<const ExactDistance>(mesh, options, progress);
  });
}

std::shared_ptr<const DistanceFunction> withNormalization(const std::shared_ptr<const ExactDistance>& exact,
                                                          const Normalization& normalization) {
  Source source = exact->source();
  source.normalization = normalization;
  return std::make_shared<const DistanceFunction>(exact, std::move(source));
}

std::shared_ptr<const ExactDistance> distanceToMesh(const Console& console, const std::string& surface,
                                                    const PreparedSurface& prepared, const DistanceOptions& options) {
  auto exact = distanceTo(console, prepared.mesh, options);
  tellInsideTest(console, surface, *prepared.report, exact->insideTestChoice(), prepared.normalization);
  return exact;
}

std::shared_ptr<const DistanceFunction> distanceTo(const Console& console, const std::string& surface,
                                                   const PreparedSurface& prepared, const DistanceOptions& options) {
  if (prepared.function) return std::make_shared<const DistanceFunction>(*prepared.function);
  return withNormalization(distanceToMesh(console, surface, prepared, options), prepared.normalization);
}

}  // namespace hpsdf::app
