#include "explorer/explorer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "console/console.h"
#include "console/interrupt.h"
#include "construction/file_kind.h"
#include "explorer/exact_outline.h"
#include "explorer/gizmo.h"
#include "explorer/worst_places.h"
#include "hpsdf/detail/build_settings.h"
#include "language/script.h"
#include "pictures/picture_arguments.h"
#include "pictures/up_axis.h"
#include "session/field_operands.h"
#include "session/field_summary.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

// Sizes in points.
constexpr double kBarHeight = 30, kReadoutHeight = 46, kColumnWidth = 268;
constexpr double kSmallestCanvas = 160;
constexpr double kClick = 3;  // distance that the pointer may move during a click
constexpr double kDegreesPerPoint = 0.4;

// Names of the scripts that the explorer makes, with which messages of their errors begin.
constexpr const char *kPanelScript = "panel", *kOpenScript = "open", *kPresetScript = "preset", *kApplyScript = "apply";

double rounded(double value, double step) { return std::round(value / step) * step; }

std::string vectorWord(const Vector3& v) { return fmt::format("{:.6g},{:.6g},{:.6g}", v.x(), v.y(), v.z()); }

/// Returns the names of the command and the parameters in a script line, without values. If two successive lines have
/// the same names, the second line alone has the effect of both lines. Returns "" for a command whose effect depends on
/// the explorer's previous state.
std::string kindOf(const std::string& line) {
  constexpr std::array kSetters = {"show",      "camera", "surface", "plane", "cells",   "arrows",
                                   "triangles", "color",  "panel",   "worst", "settings"};
  std::istringstream words(line);
  std::string kind, word;
  words >> kind;
  if (std::ranges::find(kSetters, kind) == kSetters.end()) return {};
  while (words >> word) {
    const bool number = word.find_first_of("0123456789") <= 1;
    kind += " " + (number ? "#" : word.substr(0, word.find('=')));
  }
  return kind;
}

/// Returns `view` with the frame's size, scale and samples, the renderer and the list of keys of the state `frame`,
/// which undo leaves alone.
ViewState withFrameOf(const ViewState& frame, ViewState view) {
  view.width = frame.width;
  view.height = frame.height;
  view.scale = frame.scale;
  view.samples = frame.samples;
  view.backend = frame.backend;
  view.open[static_cast<std::size_t>(Panel::keys)] = frame.isOpen(Panel::keys);
  return view;
}

/// Returns `view` without what belongs to one field alone: directions, places, cuts, marks, cells and other fields.
ViewState wholeOf(ViewState view) {
  view.planeOffset.reset();
  view.plane.reset();
  view.zoom = 1;
  view.operands.clear();
  view.sliceTarget.reset();
  view.camera = {.up = view.camera.up, .projection = view.camera.projection};
  view.surface = true;
  view.cracks = view.planeInSpace = false;
  view.cells = {};
  view.surfaceOffset = 0;
  view.clip.reset();
  view.defects.clear();
  view.beside.clear();
  for (Coloring* colors : {&view.surfaceColors, &view.sliceColors}) {
    if (colors->by == render::ColorBy::difference || colors->by == render::ColorBy::error)
      colors->by = colors == &view.sliceColors ? render::ColorBy::degree : render::ColorBy::normal;
    colors->scale.limits.reset();
    colors->other.clear();
    colors->mesh.clear();
  }
  view.worstPage = 0;
  view.mark.reset();
  return view;
}

/// Enlarges a picture by repeating its pixels.
render::Image enlarged(const render::Image& image, int width, int height) {
  render::Image result(width, height, {});
  std::vector<int> columns(std::size_t(width), 0);
  for (int x = 0; x < width; ++x) columns[std::size_t(x)] = std::min(image.width - 1, x * image.width / width);
  const auto rowOf = [&](int y) { return std::min(image.height - 1, y * image.height / height); };
  for (int y = 0; y < height; ++y) {
    if (y > 0 && rowOf(y) == rowOf(y - 1)) {
      std::copy_n(&result.at(0, y - 1), width, &result.at(0, y));
      continue;
    }
    const render::Color* const from = &image.at(0, rowOf(y));
    render::Color* const to = &result.at(0, y);
    for (int x = 0; x < width; ++x) to[x] = from[columns[std::size_t(x)]];
  }
  return result;
}

}  // namespace

Layout layoutOf(const ViewState& view) {
  const double width = view.width, height = view.height;
  const double bar = std::round(kBarHeight * view.scale), readout = std::round(kReadoutHeight * view.scale);
  const double column = std::round(kColumnWidth * view.scale), smallest = kSmallestCanvas * view.scale;
  const auto open = [&](Panel panel) { return view.isOpen(panel); };
  Layout layout;
  double top = 0, bottom = height, left = 0, right = width;
  if (open(Panel::bar) && height >= smallest) layout.bar = {0, 0, width, top = bar};
  if (open(Panel::readout) && bottom - top - readout >= smallest)
    layout.readout = {0, bottom -= readout, width, height};
  const auto roomForColumn = [&] { return right - left - column >= smallest; };
  if (open(Panel::left) && roomForColumn()) layout.left = {0, top, left = column, bottom};
  if (open(Panel::right) && roomForColumn()) layout.right = {right -= column, top, width, bottom};
  layout.canvas = {left, top, right, bottom};
  if (!view.beside.empty()) {
    const double half = std::floor((right - left) / 2);
    layout.canvas.x1 = left + half;
    layout.beside = {right - half, top, right, bottom};
  }
  return layout;
}

Layout layoutInPoints(const ViewState& view) {
  Layout layout = layoutOf(view);
  for (UiRect* rect : {&layout.bar, &layout.left, &layout.right, &layout.readout, &layout.canvas, &layout.beside})
    *rect = rect->times(1 / view.scale);
  return layout;
}

std::string withoutPosition(std::string message) {
  constexpr std::array kScripts = {kPanelScript, kOpenScript, kPresetScript, kApplyScript};
  const auto isBefore = [&](const char* script) { return message.starts_with(fmt::format("{}:1:", script)); };
  while (std::ranges::any_of(kScripts, isBefore)) message.erase(0, message.find(": ") + 2);
  return message;
}

void Explorer::tellProblem(const std::string& text) { message = {printable(withoutPosition(text)), true}; }

Explorer::Explorer(Session& session) : session_(session) {
  if (session.hasField()) fieldChanged();
}

void Explorer::change(ViewState next) {
  const bool isGesture = running_ && ui_.busy();
  if (!isGesture) makeContour(next);
  // `before_` is the history before a gesture, such as the drag of a slider. A command that replaces the previous
  // command of the same gesture starts from this history again.
  if (!replaces_) before_ = {view_, undone_.size(), redone_};
  undone_.resize(before_.undone);
  redone_ = before_.redone;
  view_ = std::move(next);
  session_.setExplanation({});  // it belongs to what was shown
  if (withFrameOf(view_, before_.view) == view_) return;
  undone_.push_back(before_.view);
  redone_.clear();
}

void Explorer::changeBy(const std::string& line) {
  const History before{view_, undone_.size(), redone_};
  const auto goBackTo = [this](const History& history) {
    undone_.resize(history.undone);
    redone_ = history.redone;
    return std::exchange(view_, history.view);
  };
  try {
    runScript(session_, parseScript(session_.registry(), kPresetScript, line, {}));
  } catch (...) {
    goBackTo(before);
    throw;
  }
  change(goBackTo(before));
}

bool Explorer::goBack(std::vector<ViewState>& from, std::vector<ViewState>& to) {
  if (from.empty()) return false;
  ViewState next = withFrameOf(view_, from.back());
  if (next.guessesUp && session_.hasField()) next.camera.up = guessedUp(session_.current().field);
  makeContour(next);
  to.push_back(std::exchange(view_, std::move(next)));
  from.pop_back();
  session_.setExplanation({});
  return true;
}

BuildOptions rebuildOptions(const Field& field) {
  BuildOptions built = settingsOf(field.data());
  const FieldMetadata& metadata = field.metadata();
  if (metadata.hasEstimate()) {
    // If the construction had no target error, use the error that the field reached as the target.
    if (built.targetError.isNone() && !(built.maxError > 0)) built.targetError = metadata.totalError;
    built.maxBytes.reset();  // no control shows it, and it would keep a smaller target error from having an effect
    return built;
  }
  if (hasTolerance(field)) return built;
  // The field was built within a tolerance and changed afterwards: only these settings have a meaning without it.
  return {.grid = built.grid,
          .continuityWeight = built.continuityWeight,
          .blend = built.blend,
          .bounds = built.bounds,
          .coefficients = built.coefficients};
}

std::map<std::string, std::string> Explorer::settingsOfField() const {
  const CurrentField& current = session_.current();
  const Field& field = current.field;
  const auto corner = [](const Vector3& v) { return fmt::format("{},{},{}", v.x(), v.y(), v.z()); };
  const BuildOptions built = rebuildOptions(field);
  std::map<std::string, std::string> settings;
  for (const BuildSetting& setting : buildSettings()) {
    const std::string text = settingText(setting, built);
    const bool isStored = setting.storedAt > 0 || setting.name == "grid";
    if (built.tolerance > 0 && !setting.hasEffectWithTolerance) continue;
    if (setting.isOffered && !text.empty() && (isStored || text != defaultText(setting)))
      settings[std::string(setting.name)] = text;
  }
  const auto mesh = settings_.find("mesh");
  if (mesh != settings_.end() && mesh->second != current.madeFrom()) return settings;
  settings["domain"] = corner(field.domain().min()) + "," + corner(field.domain().max());
  if (!field.metadata().source.normalization.isIdentity()) settings["normalize"] = "true";
  return settings;
}

void Explorer::setSetting(const std::string& name, const std::string& value) {
  for (const BuildSetting& setting : buildSettings()) {
    if (setting.name == name) settings_.erase(std::string(setting.exclusive));
    if (setting.exclusive == name) settings_.erase(std::string(setting.name));
  }
  settings_[name] = value;
}

/// Removes settings of the field that the settings of the next rebuild replace, or on which these leave no effect.
void Explorer::removeWithoutEffect(std::map<std::string, std::string>& settings) const {
  const bool isWithinTolerance =
      settings_.contains("tolerance") || (settings.contains("tolerance") && !settings_.contains("target-error"));
  for (const BuildSetting& setting : buildSettings()) {
    if (settings_.contains(std::string(setting.name))) settings.erase(std::string(setting.exclusive));
    const bool ofTolerance = setting.name == "tolerance" || setting.owner == "tolerance";
    if (isWithinTolerance ? !setting.hasEffectWithTolerance : ofTolerance) settings.erase(std::string(setting.name));
  }
  // A tolerance does not outlive weak continuity.
  const auto continuity = settings.find("continuity");
  if (!isWithinTolerance || continuity == settings.end()) return;
  if (continuity->second == "weak")
    settings.erase(continuity);
  else if (continuity->second == "both")
    continuity->second = "exact";
}

void Explorer::rebuild(std::optional<int> maxSteps, bool keeps) {
  std::map<std::string, std::string> settings = settingsOfField();
  if (settings_.contains("margin") || settings_.contains("normalize")) settings.erase("domain");
  removeWithoutEffect(settings);
  for (const auto& [name, value] : settings_) settings[name] = value;
  // If the settings name a kind of continuity (weak, exact, both or none), drop the parameters of the kinds not named.
  const auto continuity = settings_.find("continuity");
  if (continuity != settings_.end() && continuity->second != "weak" && continuity->second != "both")
    settings.erase("continuity-weight");
  if (continuity != settings_.end() && continuity->second != "exact" && continuity->second != "both")
    settings.erase("blend-width");
  if (maxSteps) settings["max-steps"] = fmt::format("{}", *maxSteps);
  const auto mesh = settings_.find("mesh");
  const std::string surface = mesh != settings_.end() ? mesh->second : session_.current().madeFrom();
  if (surface.empty()) throw Error("the field does not say what it was made from: give 'settings mesh=FILE'");
  std::string line = "build " + scriptWord(surface);
  for (const auto& [name, value] : settings)
    if (name != "mesh") line += " " + name + "=" + scriptWord(value);
  std::optional<Field> before;
  if (keeps) before = session_.current().field;
  rebuilding_ = maxSteps ? Rebuilding::steps : Rebuilding::whole;
  try {
    runScript(session_, parseScript(session_.registry(), kApplyScript, line, {}));
  } catch (...) {
    rebuilding_ = Rebuilding::no;
    throw;
  }
  rebuilding_ = Rebuilding::no;
  if (!before) return;
  session_.keep(std::move(*before));
  ViewState next = view_;
  next.beside = Session::kKept;
  change(std::move(next));
}

void Explorer::fieldChanged() {
  preview_ = {};
  picture_.reset();
  figures_.reset();
  worst_.clear();
  worstAsked_ = 0;
  const auto steps = session_.current().field.metadata().steps;
  if (rebuilding_ != Rebuilding::steps || !allSteps_ || (steps && *steps > *allSteps_)) allSteps_ = steps;
  if (rebuilding_ == Rebuilding::no) settings_.clear();  // the settings belong to the previous field
  if (view_.guessesUp) view_.camera.up = guessedUp(session_.current().field);
  if (view_.operands == kOwnOperands && !session_.current().field.metadata().source.exactness) view_.operands.clear();
  ++fields_;
  try {
    makeContour(view_);
  } catch (const Cancelled&) {
    if (InterruptGuard::interrupted()) throw;
    hideTriangles(view_, "their contour was cancelled");
  }
}

/// True if `view` shows the triangles of a contour that is not known.
bool Explorer::lacksContour(const ViewState& view) const {
  if (!view.triangles || !session_.hasField()) return false;
  return !session_.knowsContour(contourChoice(view, session_.current().field));
}

/// Makes the contour whose triangles `view` shows, because no frame makes it. If it cannot be made, such as for a
/// tolerance that is too small for this field, the triangles are hidden.
void Explorer::makeContour(ViewState& view) {
  if (!lacksContour(view)) return;
  try {
    session_.contour(contourChoice(view, session_.current().field));
  } catch (const Error& error) {
    hideTriangles(view, error.what());
  }
}

/// Hides the triangles in `view`, and tells the user why.
void Explorer::hideTriangles(ViewState& view, const std::string& why) {
  view.triangles = false;
  const std::string text = "the triangles are hidden: " + why;
  warn(session_.console(), text);
  if (running_) tellProblem(text);
}

/// Ends a gesture if the mouse is idle. During a gesture, such as the drag of a slider, no contour is made, because it
/// would be outdated at once; it is made here by a command, so that it can be cancelled.
void Explorer::finishGesture() {
  if (ui_.busy()) return;
  lastKind_.clear();
  if (!lacksContour(view_)) return;
  try {
    run("triangles shown=true");
  } catch (const Error& error) {
    run("triangles shown=false");
    tellProblem(error.what());
  } catch (const Cancelled&) {
    run(canUndo() ? "undo" : "triangles shown=false");
    throw;
  }
}

void Explorer::showMesh(const TriangleMesh& mesh, const Box& domain) {
  if (view_.guessesUp) view_.camera.up = guessedUp(mesh);
  preview_.showMesh(mesh, domain, view_.backend);
}

void Explorer::showUnfinished(Field field) { preview_.showField(std::move(field), view_.backend); }

void Explorer::open(const std::string& line) {
  try {
    perform(line);
  } catch (...) {
    preview_ = {};
    shown_.clear();
    later_.clear();
    throw;
  }
  tellLater();
}

/// Tells of the lines that ran while another line was running: after that line, because a script runs them then.
void Explorer::tellLater() {
  for (const std::string& line : std::exchange(later_, {}))
    if (onCommand) onCommand(line, false);
}

void Explorer::openFile(const std::string& name) {
  const FileKind kind = kindOfFile(name);
  if (kind == FileKind::unknown) throw unknownKind(name);
  const ViewState before = std::exchange(view_, wholeOf(view_));
  const auto undone = std::exchange(undone_, {}), redone = std::exchange(redone_, {});
  opening_ = true;
  try {
    runScript(session_, parseScript(session_.registry(), kOpenScript,
                                    (kind == FileKind::field ? "load " : "build ") + scriptWord(name), {}));
  } catch (...) {
    opening_ = false;
    preview_ = {};
    drawnFor_.clear();
    view_ = withFrameOf(view_, before);
    undone_ = undone;
    redone_ = redone;
    throw;
  }
  opening_ = false;
}

/// Returns what the user is told after a command, or "" if the frame shows what it has done.
std::string Explorer::resultOf(const Command& command, const Arguments& arguments) const {
  if (const auto written = outputFiles(command, arguments); !written.empty())
    return fmt::format("{} written", printable(fmt::format("{}", fmt::join(written, ", "))));
  if (command.name != "copy-view") return "";
  return fmt::format("view copied as {} lines of script", std::ranges::count(ui_.clipboard(), '\n'));
}

/// Runs a line of script, perhaps while another line is running. Returns what the user is told afterwards.
std::string Explorer::perform(const std::string& line) {
  const bool isWithinAnother = std::exchange(running_, true);
  std::string result;
  try {
    const std::vector<Call> calls = parseScript(session_.registry(), kPanelScript, line, {});
    const std::size_t steps = undone_.size();
    runScript(session_, calls);
    if (calls.size() > 1 && undone_.size() > steps + 1) undone_.resize(steps + 1);  // the line is one step of undo
    for (const Call& call : calls) result = resultOf(*call.command, call.arguments);
  } catch (...) {
    running_ = isWithinAnother;
    throw;
  }
  running_ = isWithinAnother;
  return result;
}

void Explorer::run(const std::string& line) {
  message = {};
  const bool isWithinAnother = running_;
  const std::string kind = ui_.busy() ? kindOf(line) : "";
  replaces_ = !kind.empty() && kind == lastKind_;
  lastKind_.clear();  // if this line fails, the next line must not replace it
  try {
    const std::string result = perform(line);
    if (message.text.empty()) message = {result};
  } catch (...) {
    replaces_ = false;
    if (!isWithinAnother) later_.clear();
    throw;
  }
  lastKind_ = kind;
  const bool replaces = std::exchange(replaces_, false);
  if (isWithinAnother) {
    if (replaces) later_.pop_back();
    later_.push_back(line);
    return;
  }
  if (onCommand) onCommand(line, replaces);
  tellLater();
}

void Explorer::drawPanels(const Input* event, std::vector<std::string>& commands) {
  // Measure the jumps before the panels are drawn. The measurement is long work: its progress display draws the panels
  // too, so it must not start while they are being drawn.
  const bool showsJumps =
      view_.isUnfolded(Panel::statistics) || view_.isUnfolded(Panel::worst) || view_.isOpen(Panel::readout);
  if (!work && showsJumps && session_.hasField()) session_.jumps();
  const bool showsOtherJumps = view_.isUnfolded(Panel::statistics) || view_.isOpen(Panel::readout);
  if (!work && showsOtherJumps && beside_ && !isStale()) session_.otherJumps(view_.beside);
  ui_.frame({view_.width, view_.height, view_.scale}, event, [&] { app::drawPanels(ui_, *this, commands); });
}

/// Draws the panels three times, because scroll positions, for instance, depend on the previous frame.
void Explorer::settlePanels() {
  for (int i = 0; i < 3; ++i) {
    std::vector<std::string> ignored;  // requests to scroll back columns that became shorter
    drawPanels(nullptr, ignored);
  }
}

void Explorer::inputWhileWorking(const Input& event) {
  std::vector<std::string> commands;
  drawPanels(&event, commands);
  if (event.kind == Input::Kind::key && event.key == Key::escape && work->cancellable) cancelWanted = true;
  if (!showsPreview()) {
    if (event.kind == Input::Kind::release && dragged_ == event.button) dragged_.reset();
    return;
  }
  if (const auto command = canvasCommand(event)) commands.push_back(*command);
  for (const std::string& command : commands) runOnPreview(command);
  if (!ui_.busy()) lastKind_.clear();
}

/// Runs a command that changes the view of the preview. An error of the command must not end the long work.
void Explorer::runOnPreview(const std::string& line) {
  try {
    run(line);
  } catch (const Error&) {  // a camera or a plane out of range: nothing has changed
  }
}

void Explorer::releaseInput() {
  const auto act = [this](const Input& event) {
    try {
      input(event);
    } catch (const Error&) {
    }
  };
  for (int button = 0; button < 3; ++button)
    if (ui_.holds(button)) act({.kind = Input::Kind::release, .button = button});
  const auto pointer = ui_.pointer();
  if (ui_.editing()) act({.kind = Input::Kind::key, .key = Key::escape});  // a click would enter the text
  // A click outside of the frame closes open lists and text fields.
  act({.kind = Input::Kind::move, .at = {-1, -1}});
  act({.kind = Input::Kind::press});
  act({.kind = Input::Kind::release});
  const bool inside = UiRect{0, 0, double(view_.width), double(view_.height)}.contains(pointer[0], pointer[1]);
  if (inside) act({.kind = Input::Kind::move, .at = pointer});
}

/// Runs the commands that an event has caused. A press may enter the text of a field. If that fails, the press does
/// nothing else, such as build a field without what was typed; if it succeeds, a drag begins with the view that it
/// leaves.
void Explorer::runCommandsOf(const Input& event, const std::vector<std::string>& commands) {
  try {
    for (const std::string& command : commands) run(command);
  } catch (...) {
    if (event.kind == Input::Kind::press) {
      ui_.cancelPress();
      dragged_.reset();
    }
    throw;
  }
  if (event.kind == Input::Kind::press && dragged_ == event.button) viewAtPress_ = view_;
}

void Explorer::input(const Input& event) {
  if (work) return inputWhileWorking(event);
  if (event.kind == Input::Kind::press) message = {};
  std::vector<std::string> commands;
  drawPanels(&event, commands);
  if (const auto command = canvasCommand(event)) commands.push_back(*command);
  runCommandsOf(event, commands);
  // Draw the panels once more, because an open list must be drawn once before it takes input.
  std::vector<std::string> late;
  drawPanels(nullptr, late);
  for (const std::string& command : late) run(command);
  finishGesture();
}

const std::map<std::string, Widget>& Explorer::widgets() {
  settlePanels();
  return ui_.widgets();
}

/// Returns the command that zooms the slice or moves the camera when the mouse wheel is turned by `notches` (positive:
/// away from the user).
std::string Explorer::wheelCommand(double notches) const {
  if (view_.slice) return fmt::format("plane zoom={:.5g}", view_.zoom * std::pow(1.15, notches));
  const render::OrbitCamera& c = view_.camera;
  return fmt::format("camera {},{},{:.5g}", c.azimuthDegrees, c.elevationDegrees,
                     c.distance * std::pow(1.15, -notches));
}

/// Returns the command that changes the view when the mouse has been dragged by dx and dy pixels.
std::string Explorer::dragCommand(double dx, double dy) const {
  const UiRect canvas = layoutOf(view_).canvas;
  const double width = canvas.width(), height = canvas.height();
  if (view_.slice) {
    const Field& field = shownField();
    const render::SliceView plane =
        render::sliceView(field, slicePicture(viewAtPress_, field), int(width), int(height));
    const Vector3 target = plane.origin - plane.right * (dx / width) + plane.up * (dy / height);
    return "plane target=" + vectorWord(target);
  }
  const render::OrbitCamera& c = viewAtPress_.camera;
  if (*dragged_ == 0) {
    const double turn = kDegreesPerPoint / view_.scale;  // degrees per pixel
    return fmt::format("camera {:.6g},{:.6g},{}", rounded(c.azimuthDegrees - turn * dx, 0.1),
                       std::clamp(rounded(c.elevationDegrees + turn * dy, 0.1), -90.0, 90.0), c.distance);
  }
  // A drag with any button except the left one moves the camera's target together with the mouse. In the plane of the
  // target, the vectors scale · right and scale · up are half the picture's width and height.
  const Box& domain = shownDomain();
  const auto camera = render::cameraOf(c, domain, int(width), int(height));
  const double scale = c.projection == render::Projection::perspective ? c.distance * domain.diagonal().norm() : 1;
  const Vector3 target =
      c.target.value_or(domain.center()) + scale * (-camera.right * (2 * dx / width) + camera.up * (2 * dy / height));
  return "camera target=" + vectorWord(target);
}

/// Returns the command for a key, or std::nullopt if there is none.
std::optional<std::string> Explorer::keyCommand(const Input& event) const {
  if (event.control && event.key == Key::z && canUndo()) return "undo";
  if (event.control && event.key == Key::y && canRedo()) return "redo";
  if (event.control && event.key == Key::c) return "copy-view";
  const bool showsKeys = view_.isOpen(Panel::keys);
  if (event.key == Key::f1) return fmt::format("panel keys={}", !showsKeys);
  if (event.key == Key::escape && showsKeys) return "panel keys=false";
  return std::nullopt;
}

/// Returns the command for a character that no text field takes, or std::nullopt if there is none.
std::optional<std::string> Explorer::typedCommand(const std::string& text) const {
  if (text == "?") return fmt::format("panel keys={}", !view_.isOpen(Panel::keys));
  if (text == "s") return "show surface";
  if (text == "p") return "show slice";
  const std::size_t view = text.size() == 1 ? std::string_view("1234567").find(text[0]) : std::string::npos;
  if (view == std::string::npos || view_.slice) return std::nullopt;
  return "camera view=" + viewNames()[view];
}

/// Returns the command for a mouse event over the picture, or for a key that no text field takes. Returns
/// std::nullopt if there is no such command.
std::optional<std::string> Explorer::canvasCommand(const Input& event) {
  const Layout layout = layoutOf(view_);
  const auto [x, y] = ui_.pointer();
  if (files.isOpen()) return std::nullopt;
  if (event.kind == Input::Kind::key && !ui_.editing()) return keyCommand(event);
  if (event.kind == Input::Kind::type && !ui_.editing()) return typedCommand(event.text);
  const bool overPicture = (session_.hasField() || showsPreview()) && !ui_.wantsMouse() &&
                           (layout.canvas.contains(x, y) || layout.beside.contains(x, y));
  if (event.kind == Input::Kind::press && view_.isOpen(Panel::keys)) return "panel keys=false";
  if (event.kind == Input::Kind::press && !dragged_ && overPicture) {
    dragged_ = event.button;
    dragFrom_ = {x, y};
    viewAtPress_ = view_;
  }
  if (event.kind == Input::Kind::release && dragged_ == event.button) {
    dragged_.reset();
    const bool isClick = std::hypot(x - dragFrom_[0], y - dragFrom_[1]) < kClick * view_.scale;
    if (event.button == 0 && isClick && layout.canvas.contains(x, y)) return clickCommand();
  }
  if (event.kind == Input::Kind::wheel && overPicture) return wheelCommand(event.turn);
  if (event.kind != Input::Kind::move || !dragged_) return std::nullopt;
  return dragCommand(x - dragFrom_[0], y - dragFrom_[1]);
}

/// Returns the command for a click into the picture: it looks along the axis of the gizmo at the pointer, or explains
/// the cell there. Returns std::nullopt if the pointer is not over the field.
std::optional<std::string> Explorer::clickCommand() {
  if (const auto view = gizmoViewAt(view_, layoutInPoints(view_).canvas, ui_.pointerInPoints()))
    return "camera view=" + *view;
  const std::optional<Readout> at = readout();
  if (!at || !session_.current().field.domain().contains(at->pick.position)) return std::nullopt;
  if (!session_.knowsSurface()) {
    tellProblem("Why this cell is as it is can be told only beside its mesh, " + session_.current().madeFrom() +
                ": open the field in the folder of the mesh.");
    return std::nullopt;
  }
  return "why point=" + vectorWord(at->pick.position);
}

bool Explorer::isStale() const {
  const bool isUpToDate = coarseness_ == 0 && drawnFor_ == pictureKey();
  if (showsPreview()) return !isUpToDate;
  if (!session_.hasField()) return false;
  return !work && (!picture_ || !isUpToDate);
}

bool Explorer::redraws(int coarseness) const {
  const bool isOther = drawnFor_ != pictureKey() || coarsenessOf(coarseness) < coarseness_;
  if (showsPreview()) return isOther;
  return !work && isStale() && (isOther || !picture_);
}

const Field& Explorer::shownField() const { return showsPreview() ? *preview_.field() : session_.current().field; }

const Box& Explorer::shownDomain() const {
  return showsPreview() ? preview_.domain() : session_.current().field.domain();
}

std::string Explorer::pictureKey() const {
  ViewState shown = view_;  // parts on which the picture does not depend are reset below
  const Layout layout = layoutOf(view_);
  shown.open = {};
  shown.scroll = {};
  shown.worstPage = 0;
  return fmt::format("{} {}x{} {} {} {}", scriptOf(shown), layout.canvas.width(), layout.canvas.height(), fields_,
                     preview_.changes(), lacksContour(view_));
}

render::Drawn Explorer::drawn(render::Renderer& renderer, const Field& field, const render::ReferenceData& reference,
                              const render::ScaleOptions& scale, int coarseness) const {
  const int shrink = std::max(1, coarseness);
  const UiRect canvas = layoutOf(view_).canvas;
  const auto fit = [&](auto picture) {
    picture.width = std::max(16, int(canvas.width()) / shrink);
    picture.height = std::max(16, int(canvas.height()) / shrink);
    picture.samples = coarseness > 0 ? 1 : view_.samples;
    picture.bare = true;
    picture.scale = scale;
    if constexpr (requires { picture.shadows; }) picture.shadows = picture.shadows && coarsenessOf(coarseness) == 0;
    return picture;
  };
  // Place the plane and the camera relative to the session's current field, even if `field` is the second field, which
  // is drawn beside it. Both pictures then show the same part of space.
  const Field& current = shownField();
  return view_.slice ? render::drawSlice(renderer, field, fit(slicePicture(view_, current)), reference)
                     : render::drawSurface(renderer, field, fit(surfacePicture(view_, current)), reference);
}

render::Drawn Explorer::drawBeside(const Field& other, render::ReferenceData reference,
                                   const render::ScaleOptions& scale, int coarseness) {
  if (reference.jumps != nullptr) reference.jumps = &session_.otherJumps(view_.beside);
  reference.mesh = {};  // it is the contour of the current field
  if (view_.operands == kOwnOperands) reference.outlined = {};
  try {
    return drawn(session_.otherRenderer(view_.beside, view_.backend), other, reference, scale, coarseness);
  } catch (const Error& error) {
    throw Error(view_.beside + ": " + error.what());
  }
}

const Contour* Explorer::shownContour() const {
  if (!view_.triangles || !session_.hasField() || lacksContour(view_)) return nullptr;
  return &session_.contour(contourChoice(view_, session_.current().field));
}

/// Returns the mesh whose triangles the picture shows. There is none during a gesture that changes the surface.
render::ShownMesh Explorer::contourToDraw() const {
  const Contour* const contour = shownContour();
  if (contour == nullptr) return {};
  return {&contour->mesh, contourChoice(view_, session_.current().field).tolerance};
}

std::pair<render::Drawn, std::optional<render::Drawn>> Explorer::drawBoth(const Field* other, int coarseness) {
  const Coloring& colors = view_.colors();
  const Field& field = session_.current().field;
  render::ScaleOptions scale = colors.scale;
  render::ReferenceData reference = session_.reference(colors.by, colors.mesh, colors.other);
  if (!view_.slice && !view_.defects.empty()) reference.defects = &session_.defects(view_.defects);
  if (view_.slice && !view_.operands.empty()) reference.outlined = session_.operands(view_.operands);
  reference.mesh = contourToDraw();
  if (other != nullptr && (colors.by == render::ColorBy::degree || colors.by == render::ColorBy::depth)) {
    std::set<int> levels;
    for (const FieldStatistics& all : {figures(), session_.otherFigures(view_.beside)})
      for (const auto& [level, share] : colors.by == render::ColorBy::depth ? all.depthVolume : all.degreeVolume)
        levels.insert(level);
    scale.levels.assign(levels.begin(), levels.end());
  }
  const auto draw = [&] { return drawn(session_.renderer(view_.backend), field, reference, scale, coarseness); };
  const auto drawOther = [&] { return drawBeside(*other, reference, scale, coarseness); };
  render::Drawn picture = draw();
  if (other == nullptr) return {std::move(picture), std::nullopt};
  render::Drawn beside = drawOther();
  if (!scale.limits && picture.scale.limits && beside.scale.limits && picture.scale.limits != beside.scale.limits) {
    const std::array<double, 2> left = *picture.scale.limits, right = *beside.scale.limits;
    scale.limits = std::array{std::min(left[0], right[0]), std::max(left[1], right[1])};
    picture = draw();
    beside = drawOther();
  }
  return {std::move(picture), std::move(beside)};
}

void Explorer::drawPicture(int coarseness) {
  const Field& field = session_.current().field;
  auto [picture, beside] = drawBoth(view_.beside.empty() ? nullptr : &session_.other(view_.beside).field, coarseness);
  if (view_.slice && view_.mark && session_.knowsExact()) {
    const auto outline = [&](render::Drawn& drawn) {
      const int width = drawn.image.width, height = drawn.image.height;
      drawExactOutline(drawn.image, render::sliceView(field, slicePicture(view_, field), width, height),
                       session_.exact(""));
    };
    outline(picture);
    if (beside) outline(*beside);
  }
  // The pictures of both fields are replaced together. After an error in the code above, both are unchanged, and
  // drawnFor_ still describes them.
  picture_ = std::move(picture);
  beside_ = std::move(beside);
  shown_ = {picture_->image};
  if (beside_) shown_.push_back(beside_->image);
  coarseness_ = coarsenessOf(coarseness);
  drawnFor_ = pictureKey();
}

void Explorer::drawPreview(int coarseness) {
  const int shrink = std::max(1, coarseness);
  const UiRect canvas = layoutOf(view_).canvas;
  const int width = std::max(16, int(canvas.width()) / shrink), height = std::max(16, int(canvas.height()) / shrink);
  if (const Field* field = preview_.field())
    shown_ = {drawn(preview_.renderer(), *field, {}, view_.colors().scale, coarseness).image};
  else
    shown_ = {preview_.drawMesh(view_.camera, width, height)};
  coarseness_ = coarsenessOf(coarseness);
  drawnFor_ = pictureKey();
}

render::Image Explorer::frame(int coarseness) {
  if (session_.forgetChangedOthers()) drawnFor_.clear();
  if (redraws(coarseness)) showsPreview() ? drawPreview(coarseness) : drawPicture(coarseness);
  settlePanels();
  render::Image image(view_.width, view_.height, {250, 250, 248});
  const Layout layout = layoutOf(view_);
  const auto paste = [&](const render::Image& drawn, const UiRect& rect) {
    const int width = int(rect.width()), height = int(rect.height());
    const bool fits = drawn.width == width && drawn.height == height;
    const render::Image view = fits ? drawn : enlarged(drawn, width, height);
    for (int y = 0; y < height; ++y) std::copy_n(&view.at(0, y), width, &image.at(int(rect.x0), int(rect.y0) + y));
  };
  const std::array rects = {layout.canvas, layout.beside};
  for (std::size_t i = 0; i < shown_.size(); ++i) paste(shown_[i], rects[i]);
  ui_.paint(image);
  return image;
}

render::Image Explorer::canvasImage() {
  drawsCanvasOnly_ = true;
  render::Image whole;
  try {
    whole = frame();
  } catch (...) {
    drawsCanvasOnly_ = false;
    throw;
  }
  drawsCanvasOnly_ = false;
  const Layout layout = layoutOf(view_);
  const auto x0 = int(layout.canvas.x0), y0 = int(layout.canvas.y0);
  const auto x1 = int(layout.beside.width() > 0 ? layout.beside.x1 : layout.canvas.x1);
  render::Image image(x1 - x0, int(layout.canvas.height()), {});
  for (int y = 0; y < image.height; ++y) std::copy_n(&whole.at(x0, y0 + y), image.width, &image.at(0, y));
  return image;
}

const FieldStatistics& Explorer::figures() {
  if (!figures_) figures_ = statistics(session_.current().field);
  return *figures_;
}

const std::vector<std::size_t>& Explorer::worst(std::size_t count) {
  // The list ends where there are no more interfaces: it is as long as it was asked for, unless there are fewer.
  if (worstBy_ != view_.worstBy || worstOnSurface_ != view_.worstOnSurface || worstAsked_ < count) {
    worstAsked_ = std::max<std::size_t>(count, 100);
    worst_ = worstPlaces(session_.current().field, session_.jumps(), view_.worstBy, view_.worstOnSurface, worstAsked_);
  }
  worstBy_ = view_.worstBy;
  worstOnSurface_ = view_.worstOnSurface;
  return worst_;
}

std::optional<Readout> Explorer::readout() {
  if (work || !session_.hasField() || isStale() || ui_.wantsMouse() || dragged_) return std::nullopt;
  const Layout layout = layoutOf(view_);
  const auto [x, y] = ui_.pointer();
  const auto pickIn = [&, x = x, y = y](const Field& field, const std::optional<render::Drawn>& drawn,
                                        const UiRect& rect) {
    const bool inside = drawn && rect.contains(x, y) && x - rect.x0 < drawn->image.width;
    return inside ? render::pickAt(field, *drawn, int(x - rect.x0), int(y - rect.y0)) : std::nullopt;
  };
  if (const auto pick = pickIn(session_.current().field, picture_, layout.canvas)) return readoutAt(session_, *pick);
  if (!beside_) return std::nullopt;
  const Field& other = session_.other(view_.beside).field;
  const auto pick = pickIn(other, beside_, layout.beside);
  if (!pick) return std::nullopt;
  return readoutAt(other, session_.otherJumps(view_.beside), session_.knowsExact() ? &session_.exact("") : nullptr,
                   *pick);
}

}  // namespace hpsdf::app
