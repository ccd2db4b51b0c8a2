#include "construction/building.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "console/console.h"
#include "console/long_work.h"
#include "console/progress_line.h"
#include "construction/mesh_process.h"
#include "construction/mesh_summary.h"
#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/crossings.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/shapes.h"
#include "text/printable.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::uint64_t kMemoryUnlessTold = 100'000'000;  // of the construction, where nothing says how fine to be

/// Of a mesh, while its exact distance is made, and while that to its hull is, beside what is cut (250,000 pieces at
/// most).
constexpr double kBytesAFace = 520, kBytesAHullsFace = 800;

constexpr std::string_view kBuiltin = "builtin:";
constexpr std::string_view kAnalytic = "analytic:";

DistanceFunction normalizedFunction(const DistanceFunction& distance) {
  const Normalization to = normalizing(distance.source().box);
  Source source = distance.source();
  source.box = Box(to.scale * (source.box.min() - to.center), to.scale * (source.box.max() - to.center));
  source.normalization = to;
  auto evaluate = [distance, to](std::span<const Vector3> points, std::span<double> out) {
    std::vector<Vector3> original(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) original[i] = points[i] / to.scale + to.center;
    distance(original, out);
    for (double& value : out) value *= to.scale;
  };
  return DistanceFunction(std::move(evaluate), source);  // moved: of an lvalue it would keep a reference
}

bool wantsNormalized(const Arguments& arguments) {
  return arguments.given("normalize") ? arguments.flag("normalize") : arguments.flag("paper");
}

Box domainOf(const Arguments& arguments, const Box& surface) {
  const std::string shape = arguments.text("domain");
  const double margin = arguments.number("margin");
  if (shape == "box") return domainAround(surface, DomainShape::box, margin);
  if (shape != "cube") {
    const auto c = arguments.numbers("domain");
    const Box domain(Vector3(c[0], c[1], c[2]), Vector3(c[3], c[4], c[5]));
    if (!(domain.sizes().minCoeff() > 0))
      throw Error(fmt::format("domain {}: expected lower corner x0,y0,z0 below upper corner x1,y1,z1", shape));
    return domain;
  }
  // exactly the paper's cube, not one that follows the rounding of the mesh's normalization
  if (wantsNormalized(arguments)) return Box(Vector3::Constant(-(1 + margin)), Vector3::Constant(1 + margin));
  return domainAround(surface, DomainShape::cube, margin);
}

/// A field that misses part of its surface is seldom meant.
void warnOfCutSurface(const Console& console, const Box& surface, const Box& domain) {
  if (!surface.isEmpty() && !domain.contains(surface))
    warn(console, fmt::format("the domain leaves out {}",
                              domain.intersects(surface) ? "part of the surface" : "the whole surface"));
}

void warnOfErrorLeft(const Console& console, const FieldMetadata& made) {
  if (made.measuredError > made.maxError)
    warn(console,
         fmt::format("errors of {} are left, above the maximum error {}: allow a higher degree, a greater depth, "
                     "more steps or bytes",
                     shortNumber(made.measuredError), shortNumber(made.maxError)));
}

/// Not worth a word: a millionth of the mesh is below what scans and fields are good for.
constexpr double kSpacingUnsaid = 1e-6;

void warnOfSpacing(const Console& console, const std::string& surface, const TriangleMesh& mesh) {
  const Box box = boundingBox(mesh);
  const double spacing = coordinateSpacing(surface, mesh), size = box.sizes().maxCoeff();
  if (!(spacing > kSpacingUnsaid * size)) return;
  warn(console, fmt::format("{}: coordinates reach {}, where the reader keeps them {} apart ({} of the mesh's longest "
                            "side): move the mesh nearer to the origin before it is exported",
                            surface, shortNumber(std::max(-box.min().minCoeff(), box.max().maxCoeff())),
                            shortNumber(spacing), shortNumber(spacing / size)));
}

ImportedMesh readFile(const Console& console, const std::string& file) {
  if (console.meshReader.empty()) return importMesh(file);
  return withProgress(console, [&](const Progress& progress) {
    return importInSubprocess(console.meshReader, file, readingLimits(file), progress);
  });
}

/// Errors of the construction speak of options; the user thinks of the mesh.
[[noreturn]] void rethrowNaming(const std::string& surface, const Error& error) {
  const std::string message = error.what();
  if (printable(message).find(printable(surface)) != std::string::npos) throw error;  // some are printable already
  throw Error(surface + ": " + message);
}

/// A surface as a field is made from it.
struct PreparedSurface {
  std::optional<DistanceFunction> analytic;  ///< else the mesh
  TriangleMesh mesh;
  std::optional<MeshReport> report;
  Normalization normalization;

  Box box() const { return analytic ? analytic->source().box : boundingBox(mesh); }
};

PreparedSurface prepare(const Console& console, const std::string& surface, bool toNormalize) {
  PreparedSurface prepared;
  if (surface.starts_with(kAnalytic)) {
    prepared.analytic = shapes::analytic(surface);
    if (toNormalize) prepared.analytic = normalizedFunction(*prepared.analytic);
    return prepared;
  }
  ImportedMesh imported = importSurface(console, surface);
  prepared.report = imported.report;
  if (toNormalize) prepared.normalization = normalizing(boundingBox(imported.mesh));
  prepared.mesh = toNormalize ? normalized(imported.mesh) : std::move(imported.mesh);
  return prepared;
}

/// Throws `Error` where the exact distance of such a mesh does not fit in memory.
void requireDistanceMemory(const TriangleMesh& mesh, InsideTest insideTest = InsideTest::automatic) {
  requireMemory("the exact distance of " + grouped(mesh.triangles.size()) + " faces",
                (insideTest == InsideTest::outerHull ? kBytesAHullsFace : kBytesAFace) * double(mesh.triangles.size()),
                "simplify the mesh first");
}

struct SharedDistance {
  std::shared_ptr<const ExactDistance> exact;

  void operator()(std::span<const Vector3> points, std::span<double> out) const { (*exact)(points, out); }
  std::size_t bytes() const { return exact->bytes(); }
};

std::shared_ptr<const DistanceFunction> distanceOf(const std::shared_ptr<const ExactDistance>& exact,
                                                   const Normalization& normalization) {
  Source source = exact->source();
  source.normalization = normalization;
  return std::make_shared<const DistanceFunction>(SharedDistance{exact}, std::move(source));
}

InsideTest insideTestOf(const std::string& name) {
  if (name == "pseudonormal") return InsideTest::pseudonormal;
  if (name == "winding") return InsideTest::winding;
  return name == "unsigned-shell" ? InsideTest::shell : InsideTest::automatic;
}

DistanceOptions distanceOptions(const Arguments& arguments) {
  DistanceOptions options{.insideTest = insideTestOf(arguments.text("sign")),
                          .threads = int(arguments.whole("threads"))};
  if (arguments.flag("hull")) {
    if (options.insideTest != InsideTest::automatic && options.insideTest != InsideTest::winding)
      throw Error(fmt::format("hull: goes by winding number: leave out sign {}", arguments.text("sign")));
    options.insideTest = InsideTest::outerHull;
  }
  if (options.insideTest == InsideTest::shell && !arguments.given("thickness"))
    throw Error("sign unsigned-shell: give the wall a thickness, such as a hundredth of the mesh's size");
  requireOwner(arguments, "thickness", "sign unsigned-shell", options.insideTest == InsideTest::shell);
  if (options.insideTest == InsideTest::shell) options.thickness = arguments.number("thickness");
  return options;
}

/// Those of a field that was made from `source`.
DistanceOptions distanceOptions(const Source& source) {
  return {.insideTest = source.insideTest, .thickness = source.thickness};
}

/// Of a closed mesh without folds all expect the sign that it gets. `choice`: of the mesh after `normalization`.
void tellSign(const Console& console, const std::string& surface, const MeshReport& report, InsideTestChoice choice,
              const Normalization& normalization) {
  if (choice.place) choice.place = *choice.place / normalization.scale + normalization.center;
  if (!choice.reason.empty() && choice.insideTest != InsideTest::pseudonormal)
    note(console, fmt::format("{}: sign by winding number: {}", surface, reasonText(choice, report.box)));
  if (choice.reason.empty() && choice.insideTest == InsideTest::pseudonormal && !report.closed())
    warn(console, unsureSigns(surface, report));
}

std::shared_ptr<const DistanceFunction> distanceTo(const Console& console, const std::string& surface,
                                                   const PreparedSurface& prepared, const DistanceOptions& options) {
  if (prepared.analytic) return std::make_shared<const DistanceFunction>(*prepared.analytic);
  const auto exact = distanceTo(console, prepared.mesh, options);
  tellSign(console, surface, *prepared.report, exact->insideTestChoice(), prepared.normalization);
  return distanceOf(exact, prepared.normalization);
}

/// ∇Φ of a shape in closed form, by differences across a millionth of it.
Vector3 differenceQuotient(const DistanceFunction& distance, const Vector3& x) {
  const double step = 1e-6 * distance.source().box.sizes().maxCoeff();
  std::array<Vector3, 6> points;
  for (int axis = 0; axis < 3; ++axis) {
    points[2 * axis] = x + step * Vector3::Unit(axis);
    points[2 * axis + 1] = x - step * Vector3::Unit(axis);
  }
  std::array<double, 6> values;
  distance(points, values);
  return Vector3(values[0] - values[1], values[2] - values[3], values[4] - values[5]) / (2 * step);
}

bool isMadeFrom(const Source& given, const Source& source) {
  return given.fingerprint == source.fingerprint && (source.fingerprint != 0 || given.name == source.name);
}

Checkpoint checkpointAt(const Console& console, const std::filesystem::path& file, const Arguments& arguments) {
  Checkpoint checkpoint{.file = file, .seconds = arguments.number("checkpoint-seconds")};
  checkpoint.about = decidingArguments(arguments);
  checkpoint.resumed = [&console, file](std::uint64_t steps) {
    note(console, fmt::format("going on from {}, after {} steps", file.string(), grouped(steps)));
  };
  checkpoint.failed = [&console, warned = false](const Error& error) mutable {
    if (std::exchange(warned, true)) return;
    if (console.redrawsProgress) console.err << kEraseLine;
    warn(console, fmt::format("{}; the construction goes on without", error.what()));
  };
  return checkpoint;
}

std::string nameOf(const Source& source) { return source.name.empty() ? "unknown" : source.name; }

}  // namespace

Parameter continuityWeightParameter() {
  return {.name = "continuity-weight",
          .type = ParameterType::number,
          .help =
              "λ of weak continuity: what a change of the field weighs against its jumps. Small for little jump, "
              "great for little error.",
          .defaultText = fmt::format("{}", WeakContinuity{}.weight),
          .minimum = 0,
          .maximum = kMaxContinuityWeight,
          .minimumExcluded = true};
}

Parameter threadsParameter(const std::string& result) {
  return {.name = "threads",
          .type = ParameterType::wholeNumber,
          .help = fmt::format("Threads to use; 0 for all. {} the same whatever their number.", result),
          .defaultText = "0",
          .minimum = 0,
          .maximum = 1024};
}

Parameter pointsParameter(std::string help, std::string count, double minimum) {
  return {.name = "points",
          .type = ParameterType::wholeNumber,
          .help = std::move(help),
          .defaultText = std::move(count),
          .minimum = minimum,
          .maximum = 1e8};  // some 100 bytes each
}

Parameter seedParameter() {
  return {.name = "seed",
          .type = ParameterType::wholeNumber,
          .help = "Which points.",
          .defaultText = "1",
          .minimum = 0,
          .maximum = 1e9};
}

std::vector<Parameter> buildParameters() {
  return {
      {.name = "target-error",
       .type = ParameterType::number,
       .help =
           "τ, the weighted squared error to reach, for a mesh whose longest side is 2; internally τ·(L/2)^5, L that "
           "side in mesh units, so that the same τ gives the same cells in any unit. Smaller is more exact.",
       .defaultText = "1e-6",
       .unit = "units^5 at that scale",
       .minimum = 0,
       .minimumExcluded = true},
      {.name = "grid",
       .type = ParameterType::numbers,
       .help = "Base cells an axis: one number for all, or NX,NY,NZ.",
       .defaultText = "6",
       .valueName = "N|NX,NY,NZ",
       .minimum = 1,
       .maximum = std::numeric_limits<int>::max(),
       .whole = true,
       .counts = {1, 3}},
      {.name = "nearness",
       .type = ParameterType::number,
       .help = "θ: how much more an error counts near the surface than far away; 0 weighs all cells alike.",
       .defaultText = "4",
       .minimum = 0,
       .maximum = 1000},
      {.name = "nearness-kind",
       .type = ParameterType::choice,
       .help =
           "How an error's weight falls with the distance s, d being the domain's diagonal: polynomial, (1 − s/d)^θ, "
           "as in the paper, or exponential, exp(−θ s/d), which falls on far away.",
       .defaultText = "polynomial",
       .choices = {"polynomial", "exponential"}},
      {.name = "near-error",
       .type = ParameterType::number,
       .help = "RMS error to reach near the surface, with far-error, in place of target error and nearness, which then "
               "follow, nearness by its exponential kind. By the estimate: 'hpsdf verify' measures what came of it.",
       .unit = "world units",
       .minimum = 0,
       .minimumExcluded = true},
      {.name = "far-error",
       .type = ParameterType::number,
       .help = "RMS error to reach farther away than near-distance, with near-error; not below it.",
       .unit = "world units",
       .minimum = 0,
       .minimumExcluded = true},
      {.name = "near-distance",
       .type = ParameterType::number,
       .help = "What near-error calls near. When left out, a hundredth of the mesh's longest side.",
       .unit = "world units",
       .minimum = 0,
       .minimumExcluded = true},
      {.name = "max-error",
       .type = ParameterType::number,
       .help = "Error to be exceeded nowhere (within the band, if there is one): after the target, if one is given, "
               "cells are looked at in 512 places each and refined on where one is worse. Dear; takes no target error "
               "unless one is given.",
       .unit = "world units",
       .minimum = 0,
       .minimumExcluded = true},
      {.name = "max-bytes",
       .type = ParameterType::wholeNumber,
       .help =
           "The best field of at most so many bytes of memory, e.g. 4e6. Takes no target error unless one is given; "
           "with max-error it ends where that is reached.",
       .unit = "bytes",
       .minimum = 1,
       .maximum = 1e15},
      {.name = "memory-limit",
       .type = ParameterType::wholeNumber,
       .help =
           "Memory that the construction may take, the mesh's exact distance included. Where more will be needed it "
           "stops as soon as that is plain, and says how much. Weak continuity's solver comes on top, some 50 bytes "
           "a "
           "coefficient, and a hull's pieces, some 80 MB at most. Left out: 1e8 besides that distance, some 240,000 "
           "cells, where target error, grid and max-steps are left out too; most meshes take less than 100,000 then. "
           "Else three quarters of the machine's memory, or of what its control group allows.",
       .unit = "bytes",
       .minimum = 1,
       .maximum = 1e15},
      {.name = "estimator",
       .type = ParameterType::choice,
       .help = "What stands for a cell's error: embedded, what the top degree adds, as in the paper, or residual, what "
               "the fit leaves of its samples. Neither takes distances of its own.",
       .defaultText = "embedded",
       .choices = {"embedded", "residual"}},
      {.name = "criterion",
       .type = ParameterType::choice,
       .help = "How degrees and depths are chosen. paper: step by step, by the gain a coefficient. optimal: a little "
               "farther than needed, then back where that saves most bytes for the error: about half of the "
               "coefficients at equal error, for 1.3 times the distances.",
       .defaultText = "paper",
       .choices = {"paper", "optimal"}},
      {.name = "max-degree",
       .type = ParameterType::wholeNumber,
       .help = "Highest degree of a cell's polynomial.",
       .defaultText = "30",
       .minimum = 1,
       .maximum = kMaxDegree},
      {.name = "max-depth",
       .type = ParameterType::wholeNumber,
       .help = "How often a base cell may be halved.",
       .defaultText = "10",
       .minimum = 0,
       .maximum = kMaxDepth},
      {.name = "max-steps",
       .type = ParameterType::wholeNumber,
       .help =
           "End after so many steps of the refinement, each of which raises one cell's degree or halves it along "
           "each axis, though the target has not been reached: 0 for the base cells alone. When left out, no limit.",
       .minimum = 0,
       .maximum = std::numeric_limits<int>::max()},
      {.name = "domain",
       .type = ParameterType::numbers,
       .help =
           "Where the field is defined by polynomials: the cube or the box around the mesh, enlarged by the margin, "
           "or two corners in world units (after normalizing).",
       .defaultText = "cube",
       .valueName = "cube|box|x0,y0,z0,x1,y1,z1",
       .choices = {"cube", "box"},
       .counts = {6}},
      {.name = "margin",
       .type = ParameterType::number,
       .help = "Of a cube or box: the part that it is larger than the mesh, e.g. 0.1 for half-sizes times 1.1.",
       .defaultText = "0.1",
       .minimum = 0},
      {.name = "normalize",
       .type = ParameterType::flag,
       .help = "Scale and centre the mesh so that its longest side spans [-1, 1], as the paper does. Without it the "
               "field "
               "stays in the mesh's own units.",
       .defaultText = "false"},
      {.name = "strategy",
       .type = ParameterType::choice,
       .help = "hp refines degree and depth; h1 and h2 are plain octrees of degree 1 or 2, for comparison.",
       .defaultText = "hp",
       .choices = {"hp", "h1", "h2"}},
      {.name = "coefficients",
       .type = ParameterType::choice,
       .help = "How coefficients are kept. auto takes float where that changes the error by less than 1 %.",
       .defaultText = "auto",
       .choices = {"auto", "float", "double"}},
      {.name = "quadrature",
       .type = ParameterType::wholeNumber,
       .help = "Order of the quadrature as a multiple of the degree. The paper takes 4; 3 needs less than half of the "
               "distances for the same error.",
       .defaultText = "3",
       .minimum = 2,
       .maximum = 8},
      {.name = "cubature",
       .type = ParameterType::choice,
       .help = "Where a cell's samples stand: compact needs half the points for the same order where such rules are "
               "known (orders up to 13); product takes Gauss points along each axis, as the paper does.",
       .defaultText = "compact",
       .choices = {"compact", "product"}},
      {.name = "sign",
       .type = ParameterType::choice,
       .help = "How inside is told from outside. pseudonormal: by the normals of what is nearest, for closed meshes "
               "that do not meet themselves. winding: by how often the faces surround a place, for any mesh; holes are "
               "closed. "
               "unsigned-shell: all is outside but a wall around the faces, --thickness wide, for sheets. auto: "
               "pseudonormal where that is certain to be right, else winding, and says why.",
       .defaultText = "auto",
       .choices = {"auto", "pseudonormal", "winding", "unsigned-shell"}},
      {.name = "hull",
       .type = ParameterType::flag,
       .help =
           "Leave out faces, or parts of them, that have the inside on both sides, such as walls within bodies that "
           "overlap: they are no surface then. The sign is by winding number.",
       .defaultText = "false"},
      {.name = "thickness",
       .type = ParameterType::number,
       .help = "Of the wall that --sign unsigned-shell makes.",
       .unit = "world units",
       .minimum = 0,
       .minimumExcluded = true},
      {.name = "band",
       .type = ParameterType::number,
       .help =
           "Width of a narrow band: cells farther from the surface than this are not refined and do not count. 0: no "
           "band.",
       .defaultText = "0",
       .unit = "world units",
       .minimum = 0},
      {.name = "enrich",
       .type = ParameterType::flag,
       .help = "Fit every cell anew at the end, one degree higher where max-degree allows: about twice the bytes, with "
               "which weak continuity costs hardly any error.",
       .defaultText = "false"},
      {.name = "continuity",
       .type = ParameterType::choice,
       .help =
           "What is done about the jumps from cell to cell. weak lets the cells' polynomials give way to each other "
           "at the end, so that the field jumps less for somewhat more error ('study continuity' shows the trade). "
           "exact: value and gradient are continuous everywhere, neighbours being blended in a thin zone along their "
           "faces; queries take up to twice as long. both: the one, then the other.",
       .defaultText = "none",
       .choices = {"none", "weak", "exact", "both"}},
      continuityWeightParameter(),
      blendWidthParameter("blend-width"),
      {.name = "bounds",
       .type = ParameterType::flag,
       .help = "Keep for each cell what is certain: how wrong the field may be anywhere in it, and how steep. With "
               "it rays "
               "and collisions miss nothing. Holds for closed meshes that do not intersect themselves.",
       .defaultText = "false"},
      threadsParameter("The field is"),
      {.name = "paper",
       .type = ParameterType::flag,
       .help =
           "All of the paper's settings but τ and grid at once: normalize, margin 0.1, cube, nearness 4, max-degree "
           "30, max-depth 10, quadrature 4 by products with samples of its own for each trial, double. Options "
           "written "
           "beside it win.",
       .defaultText = "false"},
  };
}

Parameter blendWidthParameter(std::string name) {
  return {.name = std::move(name),
          .type = ParameterType::number,
          .help =
              "How wide the blended zones are on either side of a face, as a part of a cell's edges: the wider, the "
              "gentler the gradients, and the slower the queries.",
          .defaultText = fmt::format("{}", kDefaultBlend),
          .minimum = 0,
          .maximum = kMaxBlend,
          .minimumExcluded = true};
}

std::vector<Parameter> checkpointParameters() {
  return {
      {.name = "checkpoint",
       .type = ParameterType::flag,
       .help =
           "Keep the state of the construction from time to time, as OUTPUT.checkpoint. Where that is there already, "
           "because the program was killed, go on from it: the field is the same, to the byte, as in one go. Another "
           "mesh's, one of other options but threads and memory-limit, and a damaged one are refused; once the field "
           "is written it is "
           "removed.",
       .defaultText = "false"},
      {.name = "checkpoint-seconds",
       .type = ParameterType::number,
       .help = "Of checkpoint: at least so long between two. It is longer where writing takes long: at most 2 % of the "
               "time go into it.",
       .defaultText = "5",
       .unit = "seconds",
       .minimum = 0,
       .maximum = 1e9},
  };
}

BuildOptions buildOptions(const Arguments& arguments) {
  const bool paper = arguments.flag("paper");
  BuildOptions options = paper ? paperOptions() : BuildOptions{};
  const auto decides = [&](std::string_view name) { return !paper || arguments.given(name); };
  const auto numberOr = [&](std::string_view name, double otherwise) {
    return arguments.given(name) ? arguments.number(name) : otherwise;
  };
  options.nearError = numberOr("near-error", 0);
  options.farError = numberOr("far-error", 0);
  options.nearDistance = numberOr("near-distance", 0);
  options.maxError = numberOr("max-error", 0);
  if (arguments.given("max-bytes")) options.maxBytes = static_cast<std::uint64_t>(arguments.number("max-bytes"));
  const bool endsOtherwise = options.nearError > 0 || options.farError > 0 || options.maxError > 0 || options.maxBytes;
  options.targetError = endsOtherwise && !arguments.given("target-error") ? 0 : arguments.number("target-error");
  if (arguments.text("nearness-kind") == "exponential") options.nearnessKind = NearnessKind::exponential;
  if (arguments.text("estimator") == "residual") options.estimator = Estimator::residual;
  if (arguments.text("criterion") == "optimal") options.criterion = Criterion::optimal;
  const auto grid = arguments.numbers("grid");
  for (std::size_t axis = 0; axis < 3; ++axis)
    options.grid[axis] = static_cast<std::uint32_t>(grid.size() == 1 ? grid[0] : grid[axis]);
  if (decides("nearness")) options.nearness = arguments.number("nearness");
  if (decides("max-degree")) options.maxDegree = arguments.whole("max-degree");
  if (decides("max-depth")) options.maxDepth = arguments.whole("max-depth");
  if (decides("quadrature")) options.quadrature = arguments.whole("quadrature");
  if (decides("cubature"))
    options.cubature = arguments.text("cubature") == "compact" ? CubatureKind::compact : CubatureKind::product;
  if (decides("strategy")) {
    const std::string name = arguments.text("strategy");
    options.strategy = name == "h1" ? Strategy::h1 : name == "h2" ? Strategy::h2 : Strategy::hp;
  }
  if (decides("coefficients")) {
    const std::string name = arguments.text("coefficients");
    options.coefficients = name == "float"    ? CoefficientType::float32
                           : name == "double" ? CoefficientType::float64
                                              : CoefficientType::automatic;
  }
  options.band = arguments.number("band");
  options.enrich = arguments.flag("enrich");
  options.bounds = arguments.flag("bounds");
  const std::string continuity = arguments.text("continuity");
  const bool weak = continuity == "weak" || continuity == "both", exact = continuity == "exact" || continuity == "both";
  if (weak) options.continuityWeight = arguments.number("continuity-weight");
  if (exact) options.blend = arguments.number("blend-width");
  requireOwner(arguments, "continuity-weight", "continuity weak", weak);
  requireOwner(arguments, "blend-width", "continuity exact", exact);
  requireOwner(arguments, "near-distance", "near-error", options.nearError > 0);
  if (arguments.given("max-steps")) options.maxSteps = static_cast<std::uint64_t>(arguments.number("max-steps"));
  const bool untold = arguments.has("target-error") && !endsOtherwise &&
                      std::ranges::none_of(std::array{"target-error", "grid", "max-steps"},
                                           [&](const char* name) { return arguments.given(name); });
  if (arguments.given("memory-limit"))
    options.memoryLimit = static_cast<std::uint64_t>(arguments.number("memory-limit"));
  else if (untold)
    options.memoryLimit = kMemoryUnlessTold;
  options.threads = arguments.whole("threads");
  return options;
}

void requireOwner(const Arguments& arguments, const char* name, const char* owner, bool given) {
  if (arguments.given(name) && !given)
    throw Error(fmt::format("{} belongs to {}: give that too, or leave it out", name, owner));
}

std::shared_ptr<const ExactDistance> distanceTo(const Console& console, const TriangleMesh& mesh,
                                                const DistanceOptions& options) {
  requireDistanceMemory(mesh, options.insideTest);
  return withProgress(console, [&](const Progress& progress) {
    return std::make_shared<const ExactDistance>(mesh, options, progress);
  });
}

void requireConsistent(const Arguments& arguments) {
  const Box any(Vector3::Constant(-1), Vector3::Constant(1));
  distanceOptions(arguments);
  checkBuild(domainOf(arguments, any), buildOptions(arguments));
}

bool decides(const Parameter& parameter) { return parameter.name != "threads" && parameter.name != "memory-limit"; }

std::string decidingArguments(const Arguments& arguments) {
  std::string text;
  for (const Parameter& parameter : buildParameters()) {
    if (!decides(parameter) || !arguments.has(parameter.name)) continue;
    const std::vector<double> numbers = arguments.numbers(parameter.name);
    text += fmt::format("{}={}\n", parameter.name,
                        numbers.empty() ? arguments.text(parameter.name) : fmt::format("{}", fmt::join(numbers, ",")));
  }
  return text;
}

std::filesystem::path checkpointOf(const std::filesystem::path& output) { return output.string() + ".checkpoint"; }

BuildInput buildInput(const Console& console, const std::string& surface, const Arguments& arguments) {
  try {
    const BuildOptions options = buildOptions(arguments);  // mistakes, before long work
    const DistanceOptions ofMesh = distanceOptions(arguments);
    if (surface.starts_with(kAnalytic))
      for (const char* name : {"sign", "thickness", "hull"})
        if (arguments.given(name)) throw Error(std::string(name) + ": an analytic shape has a sign of its own");
    const PreparedSurface prepared = prepare(console, surface, wantsNormalized(arguments));
    const Box box = prepared.box(), domain = domainOf(arguments, box);
    checkBuild(domain, options);
    warnOfCutSurface(console, box, domain);
    const auto start = std::chrono::steady_clock::now();
    BuildInput input{distanceTo(console, surface, prepared, ofMesh), prepared.report, domain, options};
    input.setUpSeconds = secondsSince(start);
    // where nobody named a limit, it is for what grows
    if (input.options.memoryLimit && !arguments.given("memory-limit"))
      *input.options.memoryLimit += input.exact->bytes();
    return input;
  } catch (const Error& error) {
    rethrowNaming(surface, error);
  }
}

BuiltField buildField(const Console& console, const std::string& surface, const Arguments& arguments,
                      const std::filesystem::path& checkpoint) {
  BuildInput input = buildInput(console, surface, arguments);
  try {
    const auto start = std::chrono::steady_clock::now();
    Field field = withProgress(console, [&](const Progress& progress) {
      if (checkpoint.empty()) return build(*input.exact, input.domain, input.options, progress);
      return buildResumably(*input.exact, input.domain, input.options, checkpointAt(console, checkpoint, arguments),
                            progress);
    });
    warnOfErrorLeft(console, field.metadata());
    if (input.options.bounds) warnOfBounds(console, input.mesh);
    return {std::move(field), std::move(input.exact), input.mesh, input.setUpSeconds + secondsSince(start)};
  } catch (const Error& error) {
    if (!checkpoint.empty() && std::string_view(error.what()).starts_with(checkpoint.string())) throw;
    rethrowNaming(surface, error);
  }
}

void warnOfBounds(const Console& console, const std::optional<MeshReport>& mesh) {
  if (mesh && !mesh->closed())
    warn(console, "bounds hold for closed surfaces alone: beside this mesh's holes they do not");
}

bool isShape(std::string_view surface) { return surface.starts_with(kBuiltin) || surface.starts_with(kAnalytic); }

void warnOfForeign(const Console& console, const std::string& surface, const Source& source) {
  warn(console, fmt::format("{} is not what the field was made from ({})", surface, nameOf(source)));
}

std::shared_ptr<const DistanceFunction> exactDistance(const Console& console, const std::string& surface,
                                                      const Source& source) {
  try {
    const PreparedSurface prepared = prepare(console, surface, !source.normalization.isIdentity());
    auto exact = distanceTo(console, surface, prepared, distanceOptions(source));
    if (!isMadeFrom(exact->source(), source)) warnOfForeign(console, surface, source);
    return exact;
  } catch (const Error& error) {
    rethrowNaming(surface, error);
  }
}

ReferenceSurface referenceSurface(const Console& console, const std::string& surface, const Source& source) {
  try {
    PreparedSurface prepared = prepare(console, surface, !source.normalization.isIdentity());
    ReferenceSurface reference;
    reference.report = prepared.report;
    if (prepared.analytic) {
      reference.distance = std::make_shared<const DistanceFunction>(*prepared.analytic);
      reference.mesh = shapes::mesh(surface.substr(kAnalytic.size()));
      const Normalization to = prepared.analytic->source().normalization;
      for (Vector3& vertex : reference.mesh.vertices) vertex = to.scale * (vertex - to.center);
      reference.normal = [distance = reference.distance](const Vector3& x, double) {
        return differenceQuotient(*distance, x);
      };
    } else {
      const auto exact = distanceTo(console, prepared.mesh, distanceOptions(source));
      reference.distance = distanceOf(exact, prepared.normalization);
      reference.mesh = source.insideTest == InsideTest::outerHull ? exact->surface() : std::move(prepared.mesh);
      // nearer than this, rounding decides the direction
      const double least = 1e-9 * exact->source().box.sizes().maxCoeff();
      reference.normal = [exact, least](const Vector3& x, double signedDistance) {
        const ClosestPoint closest = exact->closestPoint(x);
        const Vector3 away = x - closest.point;
        const double distance = away.norm(), thickness = exact->source().thickness;
        // what closes a hole is nearer than the faces, and has no normal that is known
        const bool besideHole = std::abs(std::abs(signedDistance + thickness / 2) - distance) > least;
        if (distance < least || besideHole) return Vector3(Vector3::Zero());
        return Vector3(away / (thickness == 0 && signedDistance < 0 ? -distance : distance));
      };
    }
    reference.fieldIsMadeFromIt = isMadeFrom(reference.distance->source(), source);
    return reference;
  } catch (const Error& error) {
    rethrowNaming(surface, error);
  }
}

MeshDefects meshDefects(const Console& console, const std::string& surface, const Source& source) {
  try {
    const PreparedSurface prepared = prepare(console, surface, !source.normalization.isIdentity());
    if (prepared.analytic) throw Error(surface + ": an analytic shape has no mesh, and so no defects");
    requireDistanceMemory(prepared.mesh);
    if (!isMadeFrom({.name = prepared.mesh.name, .fingerprint = fingerprint(prepared.mesh)}, source))
      warnOfForeign(console, surface, source);
    return findDefects(prepared.mesh, withProgress(console, [&](const Progress& progress) {
                         return findCrossings(prepared.mesh, kMostCrossings, progress);
                       }));
  } catch (const Error& error) {
    rethrowNaming(surface, error);
  }
}

ImportedMesh importSurface(const Console& console, const std::string& surface) {
  if (surface.starts_with(kAnalytic))
    throw Error(
        fmt::format("{}: an analytic shape has no mesh; take builtin:{}", surface, surface.substr(kAnalytic.size())));
  if (surface.starts_with(kBuiltin)) {
    TriangleMesh mesh = shapes::mesh(surface);
    const MeshReport report = inspect(mesh);
    return {std::move(mesh), report};
  }
  ImportedMesh imported = readFile(console, surface);
  warnOfSpacing(console, surface, imported.mesh);
  return imported;
}

}  // namespace hpsdf::app
