#include <fmt/format.h>

#include <chrono>
#include <string>
#include <utility>

#include "commands/commands.h"
#include "commands/made_field.h"
#include "console/interrupt.h"
#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "construction/build_field.h"
#include "construction/surface.h"
#include "hpsdf/build.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/verify.h"
#include "session/field_argument.h"
#include "session/field_summary.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

PreparedSurface loadMesh(const Console& console, const std::string& surface, const Source& source) {
  return namingSurface(surface, [&] {
    requireMesh(surface);
    PreparedSurface prepared = prepareSurface(console, surface, !source.normalization.isIdentity());
    const Normalization &found = prepared.normalization, &wanted = source.normalization;
    if (found.scale != wanted.scale || found.center != wanted.center)
      throw Error("has another box than the mesh of the field, which is normalized: build its field anew");
    return prepared;
  });
}

/// Returns the options for the distance to the changed mesh. Where the field's signs come from pseudonormals, they must
/// be certain for the changed mesh, too.
DistanceOptions distanceOptionsFor(const Source& source, int threads) {
  const bool isByNormals = source.insideTest == InsideTest::pseudonormal;
  return {.insideTest = isByNormals ? InsideTest::automatic : source.insideTest,
          .thickness = source.thickness,
          .threads = threads};
}

std::string percent(double share) { return fmt::format("{:.1f} %", 100 * share); }

/// The figures of a rebuilt field besides its own.
struct RebuildFigures {
  std::uint64_t changedTriangles, leaves, kept, distances, distancesBefore;
  double keptVolume, seconds;
  bool signsChange;

  double keptShare() const { return leaves > 0 ? double(kept) / double(leaves) : 0; }
  double distanceShare() const { return distancesBefore > 0 ? double(distances) / double(distancesBefore) : 0; }
};

Json figuresJson(const RebuildFigures& figures) {
  return {{"changed_triangles", figures.changedTriangles},
          {"leaves_before", figures.leaves},
          {"kept_leaves", figures.kept},
          {"kept_volume", figures.keptVolume},
          {"distances", figures.distances},
          {"distances_before", figures.distancesBefore},
          {"signs_change", figures.signsChange},
          {"seconds", figures.seconds}};
}

std::string figuresText(const RebuildFigures& figures) {
  return fmt::format("kept: {} of {} leaves ({}), {} of the domain; {} triangles differ\n", grouped(figures.kept),
                     grouped(figures.leaves), percent(figures.keptShare()), percent(figures.keptVolume),
                     grouped(figures.changedTriangles)) +
         fmt::format("distances: {}, {} of those that FIELD took\n", grouped(figures.distances),
                     percent(figures.distanceShare()));
}

void report(Session& session, const Arguments& arguments, const RebuildFigures& figures) {
  std::ostream& out = session.console().out;
  if (session.wantsJson(arguments)) {
    Json json = madeJson(session, arguments);
    json.update(figuresJson(figures));
    return printJson(out, json);
  }
  const Field& field = session.current().field;
  out << fmt::format("{}: {} in {:.1f} s\n", session.current().name, fieldLine(field), figures.seconds)
      << figuresText(figures) << fmt::format("measured: {}\n", measuredText(field));
}

void runRebuild(Session& session, const Arguments& arguments) {
  checkFieldOutput(arguments);
  useField(session, arguments);
  const InterruptGuard guard;  // on Ctrl-C, the file is written completely or not at all
  const Console& console = session.console();
  const std::string after = arguments.text("after");
  const Field& field = session.current().field;
  const Source& source = field.metadata().source;
  const int threads = arguments.whole("threads");
  const auto start = std::chrono::steady_clock::now();
  const PreparedSurface meshBefore = loadMesh(console, arguments.text("before"), source);
  const PreparedSurface meshAfter = loadMesh(console, after, source);
  const auto exact = distanceTo(console, after, meshAfter, distanceOptionsFor(source, threads));
  BuildOptions settings = settingsOf(field.data());
  settings.threads = threads;
  RebuiltField rebuilt = withProgress(console, [&](const Progress& progress) {
    RebuiltField made = rebuild(field, meshBefore.mesh, meshAfter.mesh, *exact, {.threads = threads}, progress);
    made.field = measured(std::move(made.field), *exact, settings, progress);
    return made;
  });
  warnOfField(console, rebuilt.field, settings, meshAfter.report);
  if (rebuilt.signsChange)
    note(console,
         "no leaf was kept, because signs may change everywhere: the inside test is another one, or a mesh has holes");
  const bool isSame = rebuilt.changedTriangles == 0;
  const RebuildFigures figures{.changedTriangles = rebuilt.changedTriangles,
                               .leaves = rebuilt.leaves,
                               .kept = rebuilt.kept,
                               .distances = isSame ? 0 : rebuilt.field.metadata().exactEvaluations,
                               .distancesBefore = field.metadata().exactEvaluations,
                               .keptVolume = rebuilt.keptVolume,
                               .seconds = secondsSince(start),
                               .signsChange = rebuilt.signsChange};
  session.setField({std::move(rebuilt.field), arguments.textOr("output", session.current().name), {}, after});
  session.setExact(exact);
  saveMade(session, arguments);
  report(session, arguments, figures);
}

}  // namespace

void addRebuildCommand(Registry& registry) {
  registry.add({
      .name = "rebuild",
      .summary = "Update the field of a mesh of which some triangles have changed.",
      .help = paragraphs(R"(
Makes the field of AFTER from FIELD, the field of BEFORE. Leaves that no changed triangle can reach stay as they are, to
the bit; the cells around the changes are built anew, with the settings that the field keeps. The result keeps to the
target error, which each update may exceed by 2 %, but takes few distances where little has changed: for editors, for parts that
move, for scans that are retouched. The report says how much was kept, and the errors that were measured.

Triangles are the same if their corners have the same coordinates; their order and numbers do not matter. BEFORE must be
the mesh from which the field was made, and AFTER must stay in the field's domain; if the field is normalized, with the same
box. A field within a tolerance or a limit of bytes, a weakly continuous one, and one of an outer hull cannot be updated.

If more than half of the triangles differ, all is built anew. So it is if signs may change everywhere: if AFTER needs another
inside test than BEFORE, or if signs come from winding numbers and one of the meshes has holes.)"),
      .examples = {"hpsdf rebuild part.hpsdf part.stl changed.stl -o changed.hpsdf"},
      .parameters = {fieldParameter(),
                     {"before", text("BEFORE").positional().required(), "Mesh from which the field was made."},
                     {"after", text("AFTER").positional().required(), "The changed mesh."},
                     fieldOutputParameter(),
                     compressParameter(),
                     threadsParameter("The field is")},
      .action = runRebuild,
  });
}

}  // namespace hpsdf::app
