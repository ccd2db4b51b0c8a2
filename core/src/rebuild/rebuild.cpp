#include "hpsdf/build.h"

#include <optional>
#include <string>
#include <vector>

#include "field/build/construction.h"
#include "field/build/limits.h"
#include "field/kept/kept_leaves.h"
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

/// Returns that no leaf is kept, so that the construction begins with the base cells.
KeptLeaves noLeavesOf(const Field& field) {
  return {.before = &field.data(), .isKept = std::vector<bool>(field.data().nodes.size())};
}

KeptLeaves keptLeavesOf(const Field& field, const rebuilding::MeshChange& change, const DistanceFunction& distance,
                        const Progress& progress) {
  // Which sides of the changed triangles are inside does not matter.
  const ExactDistance toChange(change.triangles, {.insideTest = InsideTest::pseudonormal});
  const DistanceFunction toChangedTriangles(toChange);
  const InsideTest before = field.metadata().source.insideTest, now = distance.source().insideTest;
  const bool isByNormals = before == InsideTest::pseudonormal && now == InsideTest::pseudonormal;
  const bool isShell = now == InsideTest::shell;
  return detail::findKeptLeaves(field,
                                {.now = distance,
                                 .toChange = toChangedTriangles,
                                 .offset = isShell ? distance.source().thickness / 2 : 0,
                                 .checksSigns = !isByNormals && !isShell},
                                progress);
}

FieldData fieldWith(const KeptLeaves& kept, const DistanceFunction& distance, const BuildOptions& settings,
                    const Progress& progress) {
  detail::Construction construction(distance, kept.before->domain, settings, progress);
  construction.keep(kept);
  construction.grow();
  FieldData field = construction.finish();
  field.metadata.exactEvaluations += kept.evaluations;
  field.metadata.steps = std::nullopt;
  return field;
}

/// Returns the field itself, as that of an equal mesh.
FieldData sameField(const Field& field, const Source& source) {
  FieldData same = field.data();
  same.metadata.source = source;
  return same;
}

}  // namespace

RebuiltField rebuild(const Field& field, const TriangleMesh& before, const TriangleMesh& after,
                     const DistanceFunction& distance, const RebuildOptions& options, const Progress& progress) {
  requireRebuildable(field, before, after, distance.source());
  const BuildOptions settings = settingsFor(field, options);
  detail::checkOptions(field.domain(), settings);
  return withThreads(options.threads, [&] {
    const std::uint64_t leaves = statistics(field).leaves;
    const rebuilding::MeshChange change = rebuilding::changeBetween(before, after);
    if (change.triangles.triangles.empty())
      return RebuiltField{
          .field = Field(sameField(field, distance.source())), .leaves = leaves, .kept = leaves, .keptVolume = 1};
    const bool holesMoved = change.movesHoles && distance.source().insideTest == InsideTest::winding;
    const KeptLeaves kept = holesMoved ? noLeavesOf(field) : keptLeavesOf(field, change, distance, progress);
    return RebuiltField{.field = Field(fieldWith(kept, distance, settings, progress)),
                        .changedTriangles = change.triangles.triangles.size(),
                        .leaves = leaves,
                        .kept = kept.kept,
                        .keptVolume = kept.keptVolume,
                        .holesMoved = holesMoved};
  });
}

}  // namespace hpsdf
