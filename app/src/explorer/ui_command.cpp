#include <fmt/format.h>

#include "explorer/explorer.h"
#include "explorer/explorer_commands.h"
#include "hpsdf/detail/nearest_name.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr int kDragSteps = 4;

using Point = std::array<double, 2>;

/// Parses two numbers of the form "X,Y". Returns std::nullopt for any other text.
std::optional<Point> parsePoint(const std::string& text) {
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos) return std::nullopt;
  const auto x = parseNumber(text.substr(0, comma)), y = parseNumber(text.substr(comma + 1));
  if (!x || !y) return std::nullopt;
  return Point{*x, *y};
}

/// Converts `target` to a pixel. `target` is either the text "X,Y" or the path of a widget, which stands for the
/// widget's centre. Throws `Error` for a widget that takes no input. If `types` is true, also throws `Error` for a
/// widget that takes no text.
Point targetPixel(Explorer& explorer, const std::string& target, bool types) {
  if (const auto pixel = parsePoint(target)) return *pixel;
  const auto& widgets = explorer.widgets();
  const auto found = widgets.find(target);
  if (found == widgets.end()) {
    std::vector<std::string> known;
    for (const auto& [path, widget] : widgets) known.push_back(path);
    throw Error(
        fmt::format("the frame has no widget '{}'; {}", target, didYouMean(target, known, "'ui list' names them")));
  }
  const UiRect& rect = found->second.rect;
  if (!(rect.width() > 0 && rect.height() > 0))
    throw Error(fmt::format("widget '{}' is scrolled out of sight: scroll its column, or close panels", target));
  if (!found->second.enabled) throw Error(fmt::format("widget '{}' takes no input now", target));
  if (types && !found->second.takesText)
    throw Error(fmt::format("widget '{}' takes no text: click it, or type into a field or slider", target));
  return {std::floor((rect.x0 + rect.x1) / 2), std::floor((rect.y0 + rect.y1) / 2)};
}

void moveTo(Explorer& explorer, const Point& pixel) { explorer.input({.kind = Input::Kind::move, .at = pixel}); }

void runUi(Session& session, const Arguments& arguments) {
  Explorer& explorer = explorerOf(session);
  const std::string action = arguments.text("action");
  const std::string target = arguments.textOr("target", "");
  const std::string value = arguments.textOr("value", "");
  const int button = arguments.text("button") == "right" ? 1 : 0;
  try {
    explorer.frame();  // the readout and the colour panel need the picture
  } catch (const Error&) {
    // Ignore an error in drawing the picture: the widgets work without a picture, and may be needed to correct the
    // picture's settings. The command `shot` reports the error.
  }
  if (action == "list") {
    for (const auto& [path, widget] : explorer.widgets())
      session.console().out << path << (widget.enabled ? "" : " (takes no input now)") << '\n';
    return;
  }
  if (action == "key") {
    explorer.input({.kind = Input::Kind::key,
                    .key = *keyNamed(target),
                    .control = arguments.flag("control"),
                    .shift = arguments.flag("shift")});
    return;
  }
  const Point at = targetPixel(explorer, target, action == "type");
  const bool control = arguments.flag("control") || action == "type";
  const auto press = [&] { explorer.input({.kind = Input::Kind::press, .button = button, .control = control}); };
  const auto release = [&] { explorer.input({.kind = Input::Kind::release, .button = button}); };
  moveTo(explorer, at);
  if (action == "wheel") {
    explorer.input({.kind = Input::Kind::wheel, .turn = *parseNumber(value)});
  } else if (action == "drag") {
    press();
    const Point by = *parsePoint(value);
    for (int step = 1; step <= kDragSteps; ++step)
      moveTo(explorer, {at[0] + by[0] * step / kDragSteps, at[1] + by[1] * step / kDragSteps});
    release();
  } else if (action == "click" || action == "type") {
    press();
    release();
  }
  if (action != "type") return;
  // The Ctrl+click has turned the slider into a text field and selected its number. The text typed here
  // replaces the number.
  explorer.input({.kind = Input::Kind::type, .text = value});
  explorer.input({.kind = Input::Kind::key, .key = Key::enter});
}

void checkUi(const Arguments& arguments) {
  const std::string action = arguments.text("action");
  if (action == "list") return;
  if (!arguments.has("target")) throw Error(fmt::format("ui {}: give a widget, or X,Y for a pixel", action));
  const bool takesValue = action == "drag" || action == "type" || action == "wheel";
  if (takesValue != arguments.has("value"))
    throw Error(fmt::format("ui {}: {}", action, takesValue ? "a value is missing" : "takes no value"));
  if (action == "drag" && !parsePoint(arguments.text("value")))
    throw Error(fmt::format("ui drag: expected DX,DY pixels, found '{}'", arguments.text("value")));
  if (action == "wheel" && !parseNumber(arguments.text("value")))
    throw Error(fmt::format("ui wheel: expected a number of notches, found '{}'", arguments.text("value")));
  if (action == "key" && !keyNamed(arguments.text("target"))) {
    const auto names = keyNames();
    throw Error(
        fmt::format("ui key: unknown key '{}'; {}", arguments.text("target"),
                    didYouMean(arguments.text("target"), names, fmt::format("expected {}", fmt::join(names, ", ")))));
  }
}

}  // namespace

void addUiCommand(Registry& registry) {
  registry.addForScripts({
      .name = "ui",
      .summary = "Use the explorer's widgets as a person does, by mouse and keyboard.",
      .help = "A widget is named panel/name, an entry of an open list panel/name/entry, the picture canvas; 'ui list' "
              "names those of the frame. X,Y is a pixel of the frame, from its upper left.",
      .examples = {"ui click bar/slice", "ui click view/color ; ui click view/color/depth",
                   "ui type build/target-error 1e-5", "ui drag canvas 120,-40", "ui hover 640,360",
                   "ui wheel canvas 2"},
      .parameters = {{"action",
                      choice({"click", "drag", "type", "hover", "wheel", "key", "list"}).positional().required(),
                      "click; drag: by DX,DY pixels; type: a text into a field or slider, then Enter; hover: move the "
                      "mouse there; wheel: notches, away from you; key: of the keyboard, by its name; list: name the "
                      "widgets."},
                     {"target", text("WIDGET|X,Y|KEY").positional(), "The widget, the pixel, or the key."},
                     {"value", text().positional(), "What drag, type and wheel do."},
                     {"button", choice({"left", "right"}).byDefault("left"), "Of the mouse."},
                     {"control", flag(), "With the Ctrl key held down."},
                     {"shift", flag(), "With the Shift key held down, for key."}},
      .action = runUi,
      .check = checkUi,
  });
}

}  // namespace hpsdf::app
