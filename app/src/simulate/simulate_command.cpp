#include "simulate/simulate_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "files/film.h"
#include "hpsdf/detail/output_file.h"
#include "pictures/picture_arguments.h"
#include "session/backend.h"
#include "session/session.h"
#include "simulate/scene_request.h"
#include "simulate/simulation.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

const SceneKind& kindOf(const Arguments& arguments) {
  return *std::ranges::find(scenes(), arguments.text("scene"), &SceneKind::name);
}

/// Throws `Error` if the parameter `name` was given although the scene does not use it.
void requireTaken(const Arguments& arguments, const std::string& name, bool takes) {
  if (arguments.given(name) && !takes)
    throw Error(fmt::format("{}: the scene {} does not take it; leave it out", name, arguments.text("scene")));
}

SceneRequest requestOf(const Arguments& arguments) {
  SceneRequest request = kindOf(arguments).defaults;
  requireTaken(arguments, "bodies", request.bodies > 0);
  requireTaken(arguments, "nodes", request.nodes > 0);
  requireTaken(arguments, "ground", !request.ground.empty());
  requireTaken(arguments, "body", !request.meshes.empty());
  if (arguments.given("bodies")) request.bodies = std::size_t(arguments.whole("bodies"));
  if (arguments.given("nodes")) request.nodes = std::size_t(arguments.whole("nodes"));
  if (arguments.given("points")) request.samples = std::size_t(arguments.whole("points"));
  if (arguments.given("ground")) request.ground = arguments.text("ground");
  if (arguments.given("body")) request.meshes = arguments.texts("body");
  if (arguments.has("cache")) request.cache = arguments.text("cache");
  request.filesAreYUp = arguments.text("up") == "y";
  if (arguments.given("target-error")) request.targetError = arguments.number("target-error");
  request.strategy = strategyOf(arguments);
  request.seed = std::uint64_t(arguments.whole("seed"));
  request.step = 1 / arguments.number("rate");
  request.iterations = int(arguments.whole("iterations"));
  return request;
}

Json jsonOf(const std::string& scene, const SceneRequest& request, const SimulationFigures& figures) {
  const double steps = double(figures.steps);
  const auto perStep = [&](const CountPerStep& count) {
    return Json{{"mean", count.sum / steps}, {"max", count.most}, {"last", count.last}};
  };
  return {{"scene", scene},
          {"bodies", figures.bodies},
          {"nodes", figures.nodes},
          {"waiting", figures.waiting},
          {"lost", figures.lost},
          {"simulated_seconds", figures.simulated},
          {"step_seconds", request.step},
          {"steps", figures.steps},
          {"contacts", perStep(figures.penetrating)},
          {"touching", perStep(figures.touching)},
          {"penetration",
           {{"size", figures.size},
            {"max", figures.deepest},
            {"mean_of_deepest", figures.sumOfDeepest / steps},
            {"last_second", figures.deepestAtEnd}}},
          {"milliseconds_a_step",
           {{"queries", 1e3 * figures.querySeconds / steps},
            {"solver", 1e3 * figures.solverSeconds / steps},
            {"rest", 1e3 * (figures.seconds - figures.querySeconds - figures.solverSeconds) / steps},
            {"all", 1e3 * figures.seconds / steps},
            {"longest_queries", 1e3 * figures.longestQuerySeconds}}},
          {"set_up_seconds", figures.setUpSeconds},
          {"state", fmt::format("{:016x}", figures.state)}};
}

std::string textOf(const std::string& scene, const SceneRequest& request, const SimulationFigures& figures) {
  const double steps = double(figures.steps);
  const auto milliseconds = [&](double seconds) { return fmt::format("{:.2f} ms", 1e3 * seconds / steps); };
  std::string text = fmt::format("{}: {} bodies", scene, grouped(figures.bodies));
  if (figures.nodes > 0) text += fmt::format(", {} nodes of soft bodies", grouped(figures.nodes));
  text += fmt::format(", {:.4g} s in {} steps of 1/{:.4g} s\n", figures.simulated, grouped(figures.steps),
                      1 / request.step);
  if (figures.waiting > 0)
    text += fmt::format("  still to come       {} bodies, which more --seconds let in\n", grouped(figures.waiting));
  const auto perStep = [&](const CountPerStep& count) {
    return fmt::format("{:.0f} in the mean, {} at most, {} at the end\n", count.sum / steps, grouped(count.most),
                       grouped(count.last));
  };
  text +=
      "  contacts a step     " + perStep(figures.penetrating) + "  touching a step     " + perStep(figures.touching);
  text += fmt::format("  deepest             {} ({:.2g} % of {}), in the last second {} ({:.2g} %)\n",
                      shortNumber(figures.deepest), 100 * figures.deepest / figures.size, shortNumber(figures.size),
                      shortNumber(figures.deepestAtEnd), 100 * figures.deepestAtEnd / figures.size);
  text += fmt::format("  lost bodies         {}\n", grouped(figures.lost));
  text += fmt::format("  a step takes        {}: queries {}, solver {}, rest {}\n", milliseconds(figures.seconds),
                      milliseconds(figures.querySeconds), milliseconds(figures.solverSeconds),
                      milliseconds(figures.seconds - figures.querySeconds - figures.solverSeconds));
  text += fmt::format("  state at the end    {:016x}\n", figures.state);
  return text;
}

bool isStill(const Arguments& arguments) { return lowerExtension(arguments.text("output")) == ".png"; }

double framesPerSecond(const Arguments& arguments) { return isStill(arguments) ? 0 : arguments.number("fps"); }

double secondsOf(const Arguments& arguments) {
  return arguments.given("seconds") ? arguments.number("seconds") : kindOf(arguments).seconds;
}

void checkFilm(const Arguments& arguments) {
  if (isStill(arguments)) {
    if (arguments.given("fps")) throw Error("fps: is for films; a .png shows the end");
    return;
  }
  constexpr double kMostFrames = 10000;
  const double fps = arguments.number("fps"), rate = arguments.number("rate");
  if (fps > rate)
    throw Error(fmt::format("fps: {:g} frames a second need as many steps; there are {:g}: give rate", fps, rate));
  if (secondsOf(arguments) * fps >= kMostFrames)
    throw Error(fmt::format("fps: {:g} s of {:g} frames are more than {:g} frames: give fewer a second",
                            secondsOf(arguments), fps, kMostFrames));
}

void checkSimulate(const Arguments& arguments) {
  if (arguments.given("output")) {
    cameraPicture(arguments);
    backend(arguments);
    return checkFilm(arguments);
  }
  if (arguments.given("fps")) throw Error("fps: is for pictures: give output");
  for (const char* name : kCameraParameters)
    if (arguments.given(name)) throw Error(fmt::format("{}: is for pictures: give output", name));
}

SimulationFigures simulateAs(const Console& console, const Arguments& arguments, const SceneRequest& request,
                             const SimulationCamera* camera = nullptr) {
  return simulate(console, arguments.text("scene"), request, secondsOf(arguments), int(arguments.whole("threads")),
                  camera);
}

/// Returns the camera that the arguments describe. Without arguments for direction or distance, the defaults of the
/// scene apply.
SimulationCamera cameraOf(const Arguments& arguments, std::function<void(SimulationShot)> take) {
  render::SurfacePicture look = cameraPicture(arguments);
  const auto& [azimuth, elevation] = kindOf(arguments).view;
  if (!arguments.given("camera")) look.camera.distance = 1;
  if (!arguments.given("camera") && !arguments.given("view")) {
    look.camera.azimuthDegrees = azimuth;
    look.camera.elevationDegrees = elevation;
  }
  return {std::move(look), backend(arguments), framesPerSecond(arguments), std::move(take)};
}

/// The results of a simulation and a description of the pictures that were drawn.
struct Outcome {
  SimulationFigures figures;
  Json pictures = {};     ///< description of the pictures as JSON; null if no pictures were drawn
  std::string line = {};  ///< description of the pictures in one line; empty if no pictures were drawn
};

/// Runs a simulation and draws its final state. The field that the picture shows becomes the session's current
/// field.
Outcome runStill(Session& session, const Arguments& arguments, const SceneRequest& request) {
  const std::string file = arguments.text("output");
  checkWritable(file);
  std::optional<CurrentField> shown;
  std::optional<render::Drawn> drawn;
  const SimulationCamera camera = cameraOf(arguments, [&](SimulationShot shot) {
    shown = CurrentField{shot.field, shot.field.metadata().source.name};
    drawn = std::move(shot.drawn);
    session.setLastRenderer(shot.renderer);
  });
  const SimulationFigures figures = simulateAs(session.console(), arguments, request, &camera);
  const int width = drawn->image.width, height = drawn->image.height;
  savePng(drawn->image, file);
  session.setField(std::move(*shown));
  session.setPicture(std::move(*drawn));
  return {figures,
          {{"output", file}, {"width", width}, {"height", height}, {"renderer", session.lastRenderer()}},
          fmt::format("{}: {}x{}, {}\n", file, width, height, session.lastRenderer())};
}

Outcome runFilm(Session& session, const Arguments& arguments, const SceneRequest& request) {
  Film film(arguments.text("output"));
  const InterruptGuard guard;  // on Ctrl-C, the film is published completely or not at all
  const SimulationCamera camera = cameraOf(arguments, [&](SimulationShot shot) {
    film.add(shot.drawn.image, {{"seconds", shot.seconds}, {"contacts", shot.contacts}});
    session.setLastRenderer(shot.renderer);
  });
  const SimulationFigures figures = simulateAs(session.console(), arguments, request, &camera);
  withProgress(session.console(), [&](const Progress& progress) {
    film.encode(framesPerSecond(arguments), progress);
    return true;
  });
  const Json about = film.publish(session.lastRenderer());
  return {figures, about, Film::line(about)};
}

Outcome runScene(Session& session, const Arguments& arguments, const SceneRequest& request) {
  if (!arguments.given("output")) return {simulateAs(session.console(), arguments, request)};
  return isStill(arguments) ? runStill(session, arguments, request) : runFilm(session, arguments, request);
}

void runSimulate(Session& session, const Arguments& arguments) {
  const Console& console = session.console();
  const SceneRequest request = requestOf(arguments);
  const Outcome outcome = runScene(session, arguments, request);
  const std::string scene = arguments.text("scene");
  if (!session.wantsJson(arguments)) {
    console.out << textOf(scene, request, outcome.figures) << outcome.line;
    return;
  }
  Json json = jsonOf(scene, request, outcome.figures);
  if (!outcome.pictures.is_null()) json["pictures"] = outcome.pictures;
  printJson(console.out, json);
}

/// Returns the camera parameters of the command `render`, but `camera` and `target` with help texts for simulations.
std::vector<Parameter> sceneCameraParameters(const Registry& registry) {
  std::vector<Parameter> parameters = cameraParameters(registry);
  Parameter& camera = parameterNamed("camera", parameters);
  camera.help =
      "Azimuth and elevation in degrees, and how far the eye is: 1 is where all of the scene, as it starts, is just in "
      "view, which is the default; each scene has its own direction.";
  camera.defaultText.clear();
  parameterNamed("target", parameters).help =
      "The point in the picture's middle, in the scene's coordinates, z up; when left out, all of the scene is in the "
      "middle.";
  return parameters;
}

/// Returns the parameters that describe a scene and its bodies.
std::vector<Parameter> sceneParameters(const std::vector<std::string>& sceneNames) {
  return {
      {"scene", choice(sceneNames).positional().required(), "Which scene."},
      {"seconds", number().above(0).atMost(3600).in("seconds"),
       "How long, in simulated time; each scene has its own default."},
      {"bodies", wholeNumber().within(1, 20000), "How many bodies move."},
      {"nodes", wholeNumber().within(4, 1e6), "How many nodes the cloth has at least; 160,000 make 320,000 triangles."},
      {"points", wholeNumber().within(1, 1e6), "Points on the surface of each kind of body."},
      {"body", text("MESH").repeatable(),
       "A mesh file or shape that bodies are made of; may be repeated. For poles, run and slope."},
      {"ground", text("MESH"),
       "The mesh file or shape that things fall on. For cloth, and for bowl, helix and run, where it is as large as it "
       "is: 2 wide suits the marbles."},
      {"up", choice({"y", "z"}).byDefault("y").under(kCamera).advanced(),
       "The axis that points up in mesh files. In shapes it is z."}};
}

/// Returns the parameters of the fields and of the physics solver.
std::vector<Parameter> solverParameters() {
  return {
      {"target-error", number().above(0).under(setting_group::kAsked),
       "τ of the fields, as 'build' has it; 1e-6 when left out, for marbles and the slope 1e-7, and 1e-8 in the bowl."},
      settingParameter("strategy"),
      {"cache", outputFile("FOLDER"), "A folder in which fields are kept, and taken from the next time."},
      {"rate", number().within(1, 100000).byDefault("240"), "Steps a second. Fast or small things need more."},
      {"iterations", wholeNumber().within(1, 1000).byDefault("20"), "Of Bullet's solver, in each step."},
      seedParameter("Which random places and directions bodies start with."),
      threadsParameter("The simulation is")};
}

const std::vector<Parameter> kFilm = {
    {"output", outputFile("FILE.png|FOLDER|FILE.mp4").as('o'),
     "*.png, a still of the end; a folder, which receives frame-0000.png, frame-0001.png … as 'turntable' has it; or "
     "*.mp4, for which ffmpeg must be installed. Without it nothing is drawn."},
    {"fps", number().within(0.1, 10000).byDefault("30"), "Frames a simulated second, at which an .mp4 plays."}};

}  // namespace

void addSimulateCommand(Registry& registry) {
  std::string kinds;
  std::vector<std::string> names;
  for (const SceneKind& kind : scenes()) {
    names.push_back(kind.name);
    kinds +=
        fmt::format("{}: {}{}; {:g} s.\n", kind.name, kind.help,
                    kind.defaults.bodies > 1 ? fmt::format(", {} by default", kind.defaults.bodies) : "", kind.seconds);
  }
  registry.add({
      .name = "simulate",
      .summary = "Let things fall onto each other, their fields as colliders: the paper's scenes, by Bullet.",
      .help = "SCENE is one of\n" + kinds + "\n" + paragraphs(R"(
Each body's surface is sampled, and the samples are looked up in the fields of the bodies around, which tell depth and
direction; Bullet's solver does the rest. Bodies have a size of 1 or so, gravity is 9.81. Tells how many samples lay in
other bodies, how deep, and what a step took. The same scene, settings and seed end in the same state, whatever the
number of threads.

With --output it is drawn, which changes nothing of it: bodies in colours of their own, what stands in clay, what has
yet to come not at all. The field of one standing body is traced; in a script a still is its picture, and it becomes the
current field. All else are meshes, whose vertices within a pixel of each other are drawn as one. Without a graphics
card a frame takes some tenths of a second, with hundreds of bodies of 100,000 triangles several seconds.

The paper's meshes are not part of the program: give your own with --body and --ground.)"),
      .examples = {"hpsdf simulate bowl", "hpsdf simulate poles --body bunny.obj --body dragon.obj --cache fields",
                   "hpsdf simulate cloth --ground dragon.obj --nodes 10000", "hpsdf simulate helix --json",
                   "hpsdf simulate bowl --bodies 300 --seconds 2 -o bowl.png --samples 2",
                   "hpsdf simulate slope -o slope.mp4 --view front --size 960x540"},
      .parameters = joined({sceneParameters(names), solverParameters(), kFilm, sceneCameraParameters(registry)}),
      .action = runSimulate,
      .check = checkSimulate,
  });
}

}  // namespace hpsdf::app
