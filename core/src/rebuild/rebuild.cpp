#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "field/build/construction.h"
#include "field/build/limits.h"
#include "field/kept/kept_leaves.h"
#include "hpsdf/build.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/exact_distance.h"
#include "rebuild/mesh_change.h"

namespace hpsdf {
namespace {

using detail::KeptLeaves;

[[noreturn]] void refuse(const std::string& what) {
  throw Error("the field " + what + ": build the changed mesh's field anew");
}

void requireRebuildable(const Field& field, const TriangleMesh& before, const TriangleMesh& after,
                        const Source& source) {
  const FieldMetadata& metadata = field.metadata();
  if (metadata.source.fingerprint != fingerprint(before))
    throw Error(ErrorKind::mesh, before.name,
                "is not the mesh of the field, which was built from " + metadata.source.name);
  if (source.fingerprint != fingerprint(after))
    throw Error(ErrorKind::mesh, after.name, "is not the mesh to which the distance measures");
  if (metadata.settings.tolerance > 0) refuse("was built within a tolerance");
  if (metadata.settings.maxBytes) refuse("was built within a limit of bytes");
  if (metadata.settings.continuityWeight) refuse("is weakly continuous");
  if (metadata.settings.targetError.isNone() && !(metadata.settings.maxError > 0)) refuse("has no target error");
  if (metadata.source.insideTest == InsideTest::outerHull || source.insideTest == InsideTest::outerHull)
    refuse("measures distances to an outer hull");
  if (metadata.source.thickness != source.thickness) refuse("has walls of another thickness");
  if (!field.domain().contains(boundingBox(after)))
    throw Error(ErrorKind::mesh, after.name, "leaves the domain of the field: build its field anew");
}

/// Returns the settings with which the cells around the change are built.
BuildOptions settingsFor(const Field& field, const RebuildOptions& options) {
  BuildOptions settings = settingsOf(field.data());
  settings.memoryLimit = options.memoryLimit;
  settings.threads = options.threads;
  return settings;
}

/// Where a change of some triangles may change signs.
enum class SignChange : std::uint8_t {
  local,       ///< only where a changed triangle is nearest, or the winding number changes
  everywhere,  ///< in the whole field, because of a hole, another inside test or the orientation of the mesh
};

SignChange signChange(const Field& field, const TriangleMesh& before, const TriangleMesh& after, const Source& now) {
  const InsideTest test = field.metadata().source.insideTest;
  if (test != now.insideTest) return SignChange::everywhere;
  if (test != InsideTest::winding) return SignChange::local;
  // A closed mesh that is oriented inward has the inside around it.
  const bool turns = (signedVolume(before) < 0) != (signedVolume(after) < 0);
  return turns || rebuilding::hasHoles(before) || rebuilding::hasHoles(after) ? SignChange::everywhere
                                                                              : SignChange::local;
}

/// Finds the leaves that are kept where some triangles differ.
KeptLeaves keptLeavesOf(const Field& field, const rebuilding::MeshChange& change, const DistanceFunction& distance,
                        const RebuildOptions& options, const Progress& progress) {
  const ExactDistance toChange(change.triangles, {.insideTest = InsideTest::pseudonormal, .threads = options.threads});
  const DistanceFunction toChangedTriangles(toChange);
  const Source& now = distance.source();
  detail::ChangedSurface changed{.now = distance, .toChange = toChangedTriangles};
  if (now.insideTest == InsideTest::shell) changed.offset = now.thickness / 2;
  if (now.insideTest == InsideTest::winding)
    changed.windingChange = [&](std::span<const Vector3> points, std::span<double> out) {
      toChange.windingNumbers(points, out);
    };
  return detail::findKeptLeaves(field, changed, progress);
}

FieldData fieldWith(KeptLeaves& kept, const DistanceFunction& distance, const BuildOptions& settings,
                    const Progress& progress) {
  detail::Construction construction(distance, kept.before->domain, settings, progress, &kept);
  construction.grow();
  FieldData field = construction.finish();
  field.metadata.exactEvaluations += kept.evaluations;
  field.metadata.steps = std::nullopt;
  return field;
}

/// Returns the field itself, as that of an equal mesh whose triangles or vertices have other numbers.
FieldData sameField(const Field& field, const Source& source) {
  FieldData same = field.data();
  same.metadata.source.name = source.name;
  same.metadata.source.fingerprint = source.fingerprint;
  return same;
}

}  // namespace

RebuiltField rebuild(const Field& field, const TriangleMesh& before, const TriangleMesh& after,
                     const DistanceFunction& distance, const RebuildOptions& options, const Progress& progress) {
  requireRebuildable(field, before, after, distance.source());
  const BuildOptions settings = settingsFor(field, options);
  detail::checkOptions(field.domain(), settings);
  return withThreads(options.threads, [&] {
    const rebuilding::MeshChange change = rebuilding::changeBetween(before, after);
    const std::size_t changed = change.triangles.triangles.size(),
                      all = before.triangles.size() + after.triangles.size();
    KeptLeaves kept = KeptLeaves::none(field.data());
    if (changed == 0 && field.metadata().source.insideTest == distance.source().insideTest)
      return RebuiltField{.field = Field(sameField(field, distance.source())),
                          .leaves = kept.leaves,
                          .kept = kept.leaves,
                          .keptVolume = 1};
    const SignChange signs = signChange(field, before, after, distance.source());
    if (signs == SignChange::local && 2 * changed <= all)
      kept = keptLeavesOf(field, change, distance, options, progress);
    FieldData made = fieldWith(kept, distance, settings, progress);
    return RebuiltField{.field = Field(std::move(made)),
                        .changedTriangles = changed,
                        .leaves = kept.leaves,
                        .kept = kept.kept,
                        .keptVolume = kept.keptVolume,
                        .signsChange = signs == SignChange::everywhere};
  });
}

}  // namespace hpsdf
