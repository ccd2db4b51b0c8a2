#include "construction/build_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "console/long_work.h"
#include "construction/operands.h"
#include "construction/surface.h"
#include "hpsdf/combine/combined_distance.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/input/distance_on_disk.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/verify.h"
#include "ranks/process_group.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

void warnOfCutSurface(const Console& console, const Box& surface, const Box& domain) {
  if (!surface.isEmpty() && !domain.contains(surface))
    warn(console, fmt::format("the domain leaves out {}",
                              domain.intersects(surface) ? "part of the surface" : "the whole surface"));
}

/// Tells what distances are beyond the samples of a grid, if the domain reaches there.
void noteBeyondSamples(const Console& console, const Box& samples, const Box& domain) {
  if (samples.isEmpty()) return;
  const Vector3 negligible = Vector3::Constant(0.01 * samples.sizes().maxCoeff());
  if (Box(samples.min() - negligible, samples.max() + negligible).contains(domain)) return;
  const Box common = domain.intersection(samples);
  const Vector3& a = common.min();
  const Vector3& b = common.max();
  note(console, fmt::format("the domain reaches beyond the grid's samples; there the distance is that at the nearest "
                            "wall of the grid and the way to it, which is too great and bends at the walls, where many "
                            "small leaves follow it{}",
                            common.isEmpty() ? std::string()
                                             : fmt::format(": --domain {},{},{},{},{},{} ends where the samples do",
                                                           a.x(), a.y(), a.z(), b.x(), b.y(), b.z())));
}

void warnOfErrorLeft(const Console& console, const FieldMetadata& built) {
  if (built.settings.maxError > 0 && built.measuredError > built.settings.maxError)
    warn(console,
         fmt::format("errors of {} are left, above the maximum error {}: allow a higher degree, a greater depth, "
                     "more steps or bytes",
                     shortNumber(built.measuredError), shortNumber(built.settings.maxError)));
}

/// Tells that a field was asked for with quantized coefficients, but has others.
void noteOtherPrecision(const Console& console, CoefficientType asked, const Field& field) {
  if (asked == CoefficientType::quantized && precisionName(field) != "quantized")
    note(console,
         fmt::format("the coefficients are {}: integers would need too many bits for the error that is asked for, or "
                     "the field has no error to compare with",
                     precisionName(field)));
}

/// Throws `Error` for arguments that need the mesh in memory.
void refuseOptionsOfMeshesInMemory(const Arguments& arguments, InsideTest insideTest) {
  if (insideTest != InsideTest::automatic && insideTest != InsideTest::pseudonormal)
    throw Error("sign: out of core, a mesh has its sign from pseudonormals: choose auto or pseudonormal");
  if (wantsNormalized(arguments))
    throw Error("normalize: out of core, a mesh keeps its units; leave it out, and errors are in units of the mesh");
  if (arguments.flag("certified") || arguments.flag("bounds"))
    throw Error("certified, bounds: out of core, nothing is proven; leave them out");
}

/// Divides a mesh into parts on the disk (`DistanceOnDisk`), in this folder. Of several processes the first one does
/// so, while the others wait. Returns the mesh as a surface that is known by its distance alone. Throws `Error` as
/// `DistanceOnDisk` does and for arguments that need the mesh in memory, and `Cancelled` after Ctrl-C.
PreparedSurface surfaceOnDisk(const Console& console, const std::string& surface, const Arguments& arguments,
                              const std::filesystem::path& folder) {
  requireMesh(surface);
  const InsideTest insideTest = distanceOptions(arguments).insideTest;
  refuseOptionsOfMeshesInMemory(arguments, insideTest);
  const DistanceOnDiskOptions options{
      .insideTest = insideTest,
      .memory = arguments.given("memory-limit") ? std::size_t(arguments.number("memory-limit") / 2) : 0,
      .threads = distanceOptions(arguments).threads};

  const auto divided = [&] {
    if (isMeshFileName(surface) && DistanceOnDisk::isMappable(surface))
      return withProgress(console, [&](const Progress& progress) {
        return std::make_shared<const DistanceOnDisk>(std::filesystem::path(surface), folder, options, progress);
      });
    const ImportedMesh imported = importSurface(console, surface);
    return withProgress(console, [&](const Progress& progress) {
      return std::make_shared<const DistanceOnDisk>(imported.mesh, folder, options, progress);
    });
  };
  std::shared_ptr<const DistanceOnDisk> distance;
  if (console.group == nullptr) {
    distance = divided();
  } else {
    if (console.group->isFirst()) distance = divided();
    console.group->hasBegun = true;  // If this process has not failed, but another one has, all of them know it.
    const std::string parts = textOfFirst(*console.group->ranks, distance ? distance->folder().string() : "");
    console.group->hasBegun = false;
    if (!distance) distance = std::make_shared<const DistanceOnDisk>(DistanceOnDisk::open(parts, options));
  }
  note(console, fmt::format("{}: {} faces in {} parts, {} in {}", surface, grouped(distance->source().faces),
                            grouped(distance->parts()), bytesText(double(distance->bytesOnDisk())),
                            distance->folder().string()));
  PreparedSurface prepared;
  prepared.function = DistanceFunction(std::move(distance));
  return prepared;
}

/// Throws `Error` for an option that has a meaning for meshes only, if the surface has none.
void refuseOptionsOfMeshes(const std::string& surface, const Arguments& arguments) {
  const bool isGrid = isGridName(surface);
  if (!surface.starts_with(kAnalytic) && !isGrid) return;
  for (const char* name : {"sign", "thickness", "hull"})
    if (arguments.given(name))
      throw Error(fmt::format("{}: {} has a sign of its own", name, isGrid ? "a grid" : "an analytic shape"));
  for (const char* name : {"certified", "bounds"})
    if (isGrid && arguments.flag(name))
      throw Error(
          fmt::format("{}: nothing is proven for the distances of a grid, between whose samples they are "
                      "interpolated; leave it out",
                      name));
}

/// Returns the name of the setting by which a construction proves its errors, or "".
std::string proofOf(const BuildOptions& options) {
  return options.certified ? "certified" : options.bounds ? "bounds" : "";
}

/// Warns if no point of a lattice in the domain is inside, because offsets and differences by values may leave nothing.
void warnOfNothingInside(const Console& console, const DistanceFunction& distance, const Box& domain) {
  constexpr int kPoints = 32;  // along each axis
  std::vector<Vector3> points;
  for (int i = 0; i < kPoints * kPoints * kPoints; ++i) {
    const Vector3 index(i % kPoints, i / kPoints % kPoints, i / (kPoints * kPoints));
    points.push_back(domain.min() + domain.sizes().cwiseProduct(index + Vector3::Constant(0.5)) / kPoints);
  }
  std::vector<double> values(points.size());
  distance(points, values);
  if (std::ranges::none_of(values, [](double value) { return value < 0; }))
    warn(console, fmt::format("none of {} points in the domain is inside: the solid is empty, or thin throughout",
                              grouped(points.size())));
}

Checkpoint checkpointAt(const Console& console, const std::filesystem::path& file, const Arguments& arguments) {
  Checkpoint checkpoint{.file = file, .seconds = arguments.number("checkpoint-seconds")};
  checkpoint.about = decidingArguments(arguments);
  checkpoint.resumed = [&console, file](std::uint64_t steps) {
    note(console, fmt::format("going on from {}, after {} steps", file.string(), grouped(steps)));
  };
  checkpoint.failed = [&console, warned = false](const Error& error) mutable {
    if (std::exchange(warned, true)) return;
    warn(console, fmt::format("{}; the construction goes on without", error.what()));
  };
  return checkpoint;
}

OfferField offerTo(WorkListener* listener) {
  if (listener == nullptr) return {};
  return [listener](const std::function<Field()>& fieldSoFar) { listener->offerField(fieldSoFar); };
}

/// Builds the field, together with other processes if there are any. Throws `PartDone` in all of them but the first.
Field constructed(const Console& console, const BuildInput& input, const Checkpoint* checkpoint,
                  const Progress& progress) {
  if (console.group != nullptr) {
    console.group->hasBegun = true;
    std::optional<Field> field =
        buildByRanks(*console.group->ranks, *input.exact, input.domain, input.options, checkpoint, progress);
    if (!field) throw PartDone();
    return std::move(*field);
  }
  if (checkpoint != nullptr) return buildResumably(*input.exact, input.domain, input.options, *checkpoint, progress);
  return build(*input.exact, input.domain, input.options, progress, offerTo(console.listener));
}

}  // namespace

std::filesystem::path checkpointOf(const std::filesystem::path& output) { return output.string() + ".checkpoint"; }

BuildInput buildInput(const Console& console, const std::string& surface, const Arguments& arguments,
                      const std::filesystem::path& partsFolder) {
  return namingSurface(surface, [&]() -> BuildInput {
    // Convert the arguments to options first, to find mistakes in the arguments before the long work starts.
    buildOptions(arguments, 1);
    const DistanceOptions insideOptions = distanceOptions(arguments);
    refuseOptionsOfMeshes(surface, arguments);

    // Load the surface, check its domain, and warn if the domain cuts the surface off. The division of a mesh into
    // parts sets up its distance.
    auto start = std::chrono::steady_clock::now();
    const PreparedSurface prepared =
        !partsFolder.empty() ? surfaceOnDisk(console, surface, arguments, partsFolder)
                             : prepareSurface(console, surface, wantsNormalized(arguments), gridPlacement(arguments));
    const Box box = prepared.box(), domain = domainFrom(arguments, box);
    BuildOptions options = buildOptions(arguments, box.sizes().maxCoeff());
    withinMemory(arguments, [&] { checkBuild(domain, options); });
    const bool isShell = insideOptions.insideTest == InsideTest::shell;
    if (options.certified && !isShell && prepared.report && !prepared.report->closed())
      throw Error("certified: the mesh has holes, beside which nothing is proven: close them, or leave certified out");
    warnOfCutSurface(console, box, domain);
    noteBeyondSamples(console, prepared.samples, domain);
    if (console.listener != nullptr && !prepared.function) console.listener->showMesh(prepared.mesh, domain);

    // Set up the exact distance function and measure how long this takes.
    if (partsFolder.empty()) start = std::chrono::steady_clock::now();
    auto exact = distanceTo(console, surface, prepared, insideOptions);
    allowDistance(options, *exact, arguments);
    return {std::move(exact), prepared.report, domain, options, secondsSince(start)};
  });
}

BuildInput combinedInput(const Console& console, const std::string& expression, const Arguments& arguments) {
  return namingSurface("expression", [&]() -> BuildInput {
    // Find mistakes in the text and in the arguments before the long work starts.
    const Expression parsed = parseExpression(expression);
    const std::string proof = proofOf(buildOptions(arguments, 1));
    const DistanceOptions insideOptions = distanceOptions(arguments);
    const Expression loaded = withLoadedOperands(console, parsed, insideOptions.insideTest, proof);

    // Set up the distance function, from which the size of the surface is known.
    const auto start = std::chrono::steady_clock::now();
    DistanceFunction distance = withProgress(console, [&](const Progress& progress) -> DistanceFunction {
      return CombinedDistance(loaded, insideOptions, progress);
    });
    if (wantsNormalized(arguments)) distance = normalizedFunction(distance);
    const double setUpSeconds = secondsSince(start);
    const Box box = distance.source().box, domain = domainFrom(arguments, box);
    BuildOptions options = buildOptions(arguments, box.sizes().maxCoeff());
    withinMemory(arguments, [&] { checkBuild(domain, options); });
    warnOfCutSurface(console, box, domain);
    warnOfNothingInside(console, distance, domain);
    allowDistance(options, distance, arguments);
    return {std::make_shared<const DistanceFunction>(std::move(distance)), std::nullopt, domain, options, setUpSeconds};
  });
}

void allowDistance(BuildOptions& options, const DistanceFunction& exact, const Arguments& arguments) {
  if (options.memoryLimit && !arguments.given("memory-limit")) *options.memoryLimit += exact.bytes();
}

BuiltField buildField(const Console& console, const std::string& surface, const Arguments& arguments,
                      const std::filesystem::path& checkpoint) {
  return buildField(console, buildInput(console, surface, arguments), surface, arguments, checkpoint);
}

BuiltField buildField(const Console& console, BuildInput input, const std::string& surface, const Arguments& arguments,
                      const std::filesystem::path& checkpoint) {
  const auto construct = [&]() -> BuiltField {
    const auto start = std::chrono::steady_clock::now();
    std::optional<Checkpoint> state;
    if (!checkpoint.empty()) state = checkpointAt(console, checkpoint, arguments);
    Field field = withProgress(console, [&](const Progress& progress) {
      return measured(constructed(console, input, state ? &*state : nullptr, progress), *input.exact, input.options,
                      progress);
    });
    warnOfField(console, field, input.options, input.mesh);
    return {std::move(field), std::move(input.exact), input.mesh, input.setUpSeconds + secondsSince(start)};
  };
  return namingSurface(
      surface, [&] { return withinMemory(arguments, construct); }, checkpoint.string());
}

void warnOfField(const Console& console, const Field& field, const BuildOptions& options,
                 const std::optional<MeshReport>& mesh) {
  warnOfErrorLeft(console, field.metadata());
  noteOtherPrecision(console, options.coefficients, field);
  if (options.bounds) warnOfBounds(console, mesh);
}

void warnOfBounds(const Console& console, const std::optional<MeshReport>& mesh) {
  if (mesh && !mesh->closed())
    warn(console, "bounds hold for closed surfaces alone: beside this mesh's holes they do not");
}

}  // namespace hpsdf::app
