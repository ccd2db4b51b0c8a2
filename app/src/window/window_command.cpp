#include <fmt/format.h>

#include "construction/file_kind.h"
#include "explorer/view_state.h"
#include "hpsdf/detail/output_file.h"
#include "pictures/picture_arguments.h"
#include "session/backend.h"
#include "text/json.h"
#include "text/text.h"
#include "window/window.h"

namespace hpsdf::app {
namespace {

void runView(Session& session, const Arguments& arguments) {
  WindowOptions options;
  const std::string field = arguments.textOr("field", "");
  if (!field.empty()) options.opening = (kindOfFile(field) == FileKind::field ? "load " : "build ") + scriptWord(field);
  options.backend = backend(arguments);
  options.width = arguments.size("size")[0];
  options.height = arguments.size("size")[1];
  if (arguments.has("scale")) options.scale = arguments.number("scale");
  options.title = field.empty() ? "hpsdf" : field + " - hpsdf";
  for (const auto& [name, file] : {std::pair("record", &options.record), std::pair("shot", &options.shot)})
    if (arguments.has(name)) checkWritable(file->emplace(arguments.text(name)));
  const std::size_t lines = showWindow(session, options);
  std::ostream& out = session.console().out;
  if (session.wantsJson(arguments))
    return printJson(out, {{"record", options.record ? Json(*options.record) : Json()},
                           {"lines", lines},
                           {"shot", options.shot ? Json(*options.shot) : Json()}});
  if (!session.hasField()) return;  // the window was closed before there was anything to write
  if (options.record) out << fmt::format("{}: {} lines\n", *options.record, lines);
  if (options.shot) out << *options.shot << '\n';
}

void checkView(const Arguments& arguments) {
  if (arguments.has("shot")) requirePng(arguments.text("shot"));
}

}  // namespace

void addWindowCommand(Registry& registry) {
  registry.add({
      .name = "view",
      .summary = "Look at a field in a window: turn it, cut it, colour it, build it anew.",
      .help = paragraphs(R"(
FIELD is a field's file (*.hpsdf), or what 'build' takes: a mesh, builtin:SHAPE or analytic:SHAPE, from which a field is
built with the default settings first. Meanwhile the window shows the progress, the mesh and then the field as it grows,
its surface or a slice, which the mouse turns and moves; closing the window cancels the construction. Without FIELD the
window invites to open a file. A file that is dropped onto the window is opened in the same way.

Mouse over the picture: drag to turn the surface or move the slice, drag with the right button to move the surface,
wheel to go nearer or farther, hover to read out what is there. In the panels: Ctrl+click a slider to type its number,
Enter to set it; click one of the worst interfaces to fly there.

Keys: Ctrl+O open a file, Ctrl+S write one, Ctrl+Z undo, Ctrl+Y redo, Ctrl+C copy the view as lines of script, F12 write
the frame as hpsdf-0001.png or the next free number, Escape cancel a construction, Ctrl+Q close the window.

Whatever is done is a command of scripts: with --record the whole session is one, and 'hpsdf run' does it again without
a window, to the same pixels. Open lists, dialogs and texts that were not entered yet are put away before a frame is
written.)"),
      .examples = {"hpsdf view bunny.hpsdf", "hpsdf view",
                   "hpsdf view builtin:torus --record session.hps --shot last.png"},
      .parameters = joined(
          {{{"field", text("FIELD|MESH").positional(),
             "A field's file, a mesh, builtin:SHAPE or analytic:SHAPE; chosen in the window when "
             "left out."},
            {"size", size(64, 8192).in("points").byDefault("1280x720").under(kPicture), "Of the window at first."},
            {"scale", number().within(kLeastScale, kGreatestScale).under(kPicture),
             "Pixels per point, the unit of text and panels; as the desktop has it when left out."},
            {"record", outputFile("SCRIPT"), "Write what was done as a script, at the end."},
            {"shot", outputFile(), "Write the last frame, *.png, at the end."}},
           backendParameters()}),
      .action = runView,
      .check = checkView,
      .commandLineOnly = true,
  });
}

}  // namespace hpsdf::app
