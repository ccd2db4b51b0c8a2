#include <algorithm>
#include <cmath>
#include <numeric>
#include <ostream>

#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "construction/build_field.h"
#include "files/film.h"
#include "language/script.h"
#include "pictures/picture_arguments.h"
#include "pictures/picture_commands.h"
#include "session/backend.h"
#include "session/field_argument.h"
#include "session/session.h"
#include "text/json.h"

namespace hpsdf::app {
namespace {

std::vector<Parameter> filmParameters(const std::string& frames, const std::string& help) {
  return {{"output", outputFile("FOLDER|FILE.mp4").as('o').required(),
           "A folder, which receives frame-0000.png, frame-0001.png …; or *.mp4, for which ffmpeg must be installed. "
           "Frames of an earlier run are removed from the folder; one that holds other things is refused."},
          {"frames", wholeNumber().within(2, 10000).byDefault(frames), help},
          {"fps", number().within(0.1, 240).byDefault("12"), "Frames a second of an .mp4."}};
}

/// Returns the parameters of a command that draws, without the parameters for its files and for JSON.
std::vector<Parameter> drawingParameters(const Registry& registry, std::string_view command) {
  return without({"field", "output", "json"}, registry.command(command).parameters);
}

/// Moves the finished film to its output and reports it to the user.
void publish(Session& session, const Arguments& arguments, Film& film) {
  const Json about = film.publish(session.lastRenderer());
  if (session.wantsJson(arguments)) return printJson(session.console().out, about);
  session.console().out << Film::line(about);
}

void runTurntable(Session& session, const Arguments& arguments) {
  render::SurfacePicture picture = surfacePicture(arguments);
  const Backend chosen = backend(arguments);
  const int frames = arguments.whole("frames");
  Film film(arguments.text("output"));
  useField(session, arguments);
  const InterruptGuard guard;  // on Ctrl-C, the film is published completely or not at all
  const render::ReferenceData reference = referenceDataFor(session, arguments, picture);
  render::Renderer& renderer = session.renderer(chosen);
  const Field& field = session.current().field;
  picture = surfacePicture(arguments, shownBox(field));
  const double first = picture.camera.azimuthDegrees;
  const bool seen = withProgress(session.console(), [&](const Progress& progress) {
    bool any = false;
    for (int frame = 0; frame < frames; ++frame) {
      progress.update("drawing frames", double(frame) / frames);
      picture.camera.azimuthDegrees = first + 360.0 * frame / frames;
      const render::Drawn drawn = render::drawSurface(renderer, field, picture, reference);
      picture.scale = drawn.scale;  // all frames use the first frame's colour scale
      any |= drawn.seen;
      film.add(drawn.image, {{"azimuth", picture.camera.azimuthDegrees}});
    }
    film.encode(arguments.number("fps"), progress);
    return any;
  });
  noteOddSurface(session.console(), field, picture, seen);
  publish(session, arguments, film);
}

/// Returns the commands that the option --of accepts: `slice` and `render` without their parameters for files
/// and for JSON.
Registry drawingCommands(const Registry& registry) {
  Registry result;
  for (const char* name : {"slice", "render"}) {
    Command command = registry.command(name);
    command.parameters = drawingParameters(registry, name);
    result.add(std::move(command));
  }
  return result;
}

/// Parses the command in the argument of the option --of. Throws `Error` "of:line:column: …".
Call drawingCall(const Registry& commands, const Arguments& arguments) {
  std::vector<Call> calls = parseScript(commands, "of", arguments.text("of"), {});
  if (calls.size() != 1) throw Error("of: expected one command, slice or render");
  return std::move(calls.front());
}

bool isSlice(const Call& call) { return call.command->name == "slice"; }

render::ColorBy colorOf(const Call& call) {
  return isSlice(call) ? slicePicture(call.arguments).color : surfacePicture(call.arguments).color;
}

void checkFrames(const Registry& commands, const Arguments& arguments) {
  const Call call = drawingCall(commands, arguments);
  colorOf(call);
  backend(call.arguments);
}

/// Draws the session's current field with the command `call`. If `scale` is given, it replaces the colour
/// scale of the picture.
render::Drawn drawFrame(Session& session, const Call& call, const std::optional<render::ScaleOptions>& scale) {
  const Arguments& arguments = call.arguments;
  const auto drawn = [&](auto picture, auto draw) {
    if (scale) picture.scale = *scale;
    const render::ReferenceData reference = referenceDataFor(session, arguments, picture);
    return draw(session.renderer(backend(arguments)), session.current().field, picture, reference);
  };
  const Box box = shownBox(session.current().field);
  if (!isSlice(call)) return drawn(surfacePicture(arguments, box), render::drawSurface);
  return drawn(slicePicture(arguments, box), render::drawSlice);
}

/// Returns the numbers of refinement steps after which a frame is drawn, in strictly ascending order: 0, then a
/// geometric sequence from 1 to `all`. There are `frames` of these numbers, but at most all + 1.
std::vector<std::uint64_t> frameSteps(std::size_t frames, std::uint64_t all) {
  frames = std::min<std::uint64_t>(frames, all + 1);
  std::vector<std::uint64_t> steps = {0};
  for (std::size_t frame = 1; frame < frames; ++frame) {
    const double share = frames == 2 ? 1 : double(frame - 1) / double(frames - 2);
    const auto wanted = static_cast<std::uint64_t>(std::llround(std::pow(double(all), share)));
    steps.push_back(std::clamp(wanted, steps.back() + 1, all - (frames - 1 - frame)));
  }
  return steps;
}

/// Extends the colour scale to all degrees or depths that can occur in a frame. The lowest of them occurs in `base`,
/// the field before refinement. The highest is already part of the scale.
void widenLevels(render::ScaleOptions& scale, const Field& base, render::ColorBy color) {
  if (scale.levels.empty()) return;
  const FieldStatistics figures = statistics(base);
  const auto& levels = color == render::ColorBy::degree ? figures.degreeLeaves : figures.depthLeaves;
  const bool hasExact = scale.levels.back() == kExactDegree;
  if (hasExact) scale.levels.pop_back();
  if (!scale.levels.empty()) {
    const int first = std::min(levels.begin()->first, scale.levels.front());
    scale.levels.resize(std::size_t(scale.levels.back() - first + 1));
    std::iota(scale.levels.begin(), scale.levels.end(), first);
  }
  if (hasExact) scale.levels.push_back(kExactDegree);
}

Json frameFigures(const Field& field) {
  return {{"steps", *field.metadata().steps}, {"leaves", statistics(field).leaves}};
}

void runFrames(Session& session, const Registry& commands, const Arguments& arguments) {
  const Call call = drawingCall(commands, arguments);
  const std::string surface = arguments.text("mesh");
  Film film(arguments.text("output"));
  const InterruptGuard guard;  // on Ctrl-C, the film is published completely or not at all
  BuiltField built = buildField(session.console(), surface, arguments);
  const std::shared_ptr<const DistanceFunction> exact = built.exact;
  session.setField({std::move(built.field), surface});
  session.setExact(exact);
  const Field& finished = session.current().field;
  const auto steps = frameSteps(std::size_t(arguments.whole("frames")), *finished.metadata().steps);
  render::ScaleOptions scale = drawFrame(session, call, std::nullopt).scale;

  std::ostream silent(nullptr);  // hides the messages of each frame
  const auto addStage = [&](Field field) {
    if (film.frames() == 0) widenLevels(scale, field, colorOf(call));
    const Json figures = frameFigures(field);
    Session stage(session.registry(), {session.console().in, silent, silent});
    stage.setField({std::move(field), surface});
    stage.setExact(exact);
    film.add(drawFrame(stage, call, scale).image, figures);
  };
  BuildOptions options = buildOptions(arguments, finished.metadata().referenceLength);
  allowDistance(options, *exact, arguments);
  withProgress(session.console(), [&](const Progress& progress) {
    const auto drawStage = [&](Field field) {
      progress.update("drawing frames", double(film.frames()) / double(steps.size()));
      addStage(std::move(field));
    };
    withinMemory(arguments, [&] {
      buildStages(*exact, finished.domain(), options, std::span(steps).first(steps.size() - 1), drawStage,
                  {.report = {}, .cancelled = progress.cancelled});
    });
    film.add(drawFrame(session, call, scale).image, frameFigures(finished));
    film.encode(arguments.number("fps"), progress);
    return true;
  });
  publish(session, arguments, film);
}

Command turntableCommand(const Registry& registry) {
  return {
      .name = "turntable",
      .summary = "Draw a field's surface from all around, as frames or an MP4.",
      .help =
          "The camera circles its target once, by even angles, from the azimuth that camera or view gives; the first "
          "frame is what 'hpsdf render' draws with the same options. Where a quantity's scale is chosen from what is "
          "shown, that of the first frame holds for all.",
      .examples = {"hpsdf turntable bunny.hpsdf -o bunny.mp4 --size 960x540 --samples 2",
                   "hpsdf turntable bunny.hpsdf -o turn --frames 36 --color degree"},
      .parameters = joined({{fieldParameter()},
                            filmParameters("72", "How many, for the whole circle."),
                            drawingParameters(registry, "render")}),
      .action = runTurntable,
  };
}

Command framesCommand(const Registry& registry) {
  const auto shared = std::make_shared<const Registry>(drawingCommands(registry));
  return {
      .name = "frames",
      .summary = "Draw how a field refines itself, as frames or an MP4.",
      .help = paragraphs(R"(
The first frame has the base cells, the last the finished field; those between have a number of refinement steps that
grows by an even factor from 1. Takes the options of 'hpsdf build', and in 'of' the command that draws each frame.
Legend and scale are those of the finished field in all frames. The surface's distances are taken twice: once to know
the number of steps, once for the frames. In a script the finished field becomes the current one.)"),
      .examples = {"hpsdf frames bunny.obj -o refinement.mp4",
                   "hpsdf frames builtin:gear -o steps --frames 12 --of 'render color=depth size=960x540'"},
      .parameters = joined(
          {{{"mesh", text("MESH").positional().required(), "Mesh file, grid file, builtin:SHAPE or analytic:SHAPE."}},
           filmParameters("30", "How many; fewer where the construction has fewer steps."),
           {{"of", text("COMMAND").byDefault("slice"),
             "What draws each frame: slice or render with options of theirs, as a line of a script."}},
           buildParameters()}),
      .action = [shared](Session& session, const Arguments& arguments) { runFrames(session, *shared, arguments); },
      .check = [shared](const Arguments& arguments) { checkFrames(*shared, arguments); },
      .drawsOnCpuBy = "--of 'slice cpu'",
  };
}

}  // namespace

void addMotionCommands(Registry& registry) {
  registry.add(turntableCommand(registry));
  registry.add(framesCommand(registry));
}

}  // namespace hpsdf::app
