#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "console/long_work.h"
#include "files/text_file.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/field_file.h"
#include "hpsdf/render/renderer.h"
#include "pictures/field_page.h"
#include "pictures/picture_commands.h"
#include "session/backend.h"
#include "session/field_argument.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Returns the renderer that the arguments choose, or that of the CPU where OpenGL cannot draw: a page is worth more
/// than the device that draws its two small pictures.
render::Renderer& pictureRenderer(Session& session, const Arguments& arguments) {
  const Backend chosen = backend(arguments);
  try {
    return session.renderer(chosen);
  } catch (const render::GlError&) {
    if (arguments.given("gl")) throw;
    return session.renderer({.cpu = true});
  }
}

std::vector<std::string> namesOf(const Arguments& arguments, const std::vector<std::string>& files) {
  const std::vector<std::string> given = arguments.texts("name");
  return given.empty() ? distinctNames(files) : given;
}

/// Adds the current field to the page.
void addCurrent(FieldPage& page, Session& session, const Arguments& arguments, const std::string& name) {
  const Field& field = session.current().field;
  if (const std::string reason = refusal(field); !reason.empty())
    throw Error(ErrorKind::field, session.current().name, reason);
  FieldInPage described{.name = name, .view = arguments.textOr("view", "")};
  if (arguments.flag("pictures"))
    described.pictures = fallbackPictures(pictureRenderer(session, arguments), field, name);
  withProgress(session.console(), [&](const Progress& progress) {
    page.add(field, described, progress);
    return true;
  });
}

void checkPage(const Arguments& arguments) {
  backend(arguments);  // throws `Error` for contradicting options
  const std::vector<std::string> names = arguments.texts("name");
  const std::size_t fields = std::max(arguments.texts("field").size(), std::size_t{1});
  if (!names.empty() && names.size() != fields)
    throw Error(ErrorKind::option, "name",
                fmt::format("given {} times for {}; give one for each field", names.size(),
                            countOf(fields, "field", "fields")));
  if (std::set<std::string>(names.begin(), names.end()).size() < names.size())
    throw Error(ErrorKind::option, "name", "two fields have the same; give them different ones");
}

void runPage(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  checkWritable(file);
  checkPageView(session.registry(), arguments.textOr("view", ""));
  const std::vector<std::string> files = arguments.texts("field");
  for (const std::string& field : files)
    if (!isFieldFile(field)) load(field);  // throws `Error` before the work on other fields begins
  const std::vector<std::string> names =
      namesOf(arguments, files.empty() ? std::vector{session.current().name} : files);
  FieldPage page;
  if (files.empty()) addCurrent(page, session, arguments, names.front());
  for (std::size_t n = 0; n < files.size(); ++n) {
    loadField(session, files[n]);
    addCurrent(page, session, arguments, names[n]);
  }
  const std::string html = page.html(arguments.textOr("title", fmt::format("{}", fmt::join(names, ", "))));
  writeTextFile(file, html);
  std::ostream& out = session.console().out;
  if (session.wantsJson(arguments))
    return printJson(out, {{"output", file}, {"file_bytes", html.size()}, {"fields", names}});
  out << fmt::format("{}: {}, opens in any browser\n", file, bytesText(double(html.size())));
}

}  // namespace

void addPageCommand(Registry& registry) {
  registry.add({
      .name = "page",
      .summary = "Write one HTML file in which fields can be turned, sliced and asked in a browser.",
      .help = paragraphs(R"(
Writes a page that holds the field and all that is needed to draw it by WebGL 2. It needs no network and sends nothing: it can be
mailed, attached to a report, or opened from a disk. The field in it is the one that is stored, and its values are computed in
double precision. Several fields stand in one page, each under a tab of its own.

Use it to show a field to somebody who has no hpsdf. The page takes about 0.09 MB besides the field, and the field a third more than
its file. Two small pictures of each field take another 0.1 MB: they are what a browser without WebGL shows, and are drawn by the CPU
where there is no OpenGL.

docs/page.md is the manual.)"),
      .examples = {"hpsdf page bunny.hpsdf -o bunny.html",
                   "hpsdf page coarse.hpsdf fine.hpsdf -o both.html --title 'Two bunnies'",
                   "hpsdf page bunny.hpsdf -o slice.html --view 'show slice; plane axis=x offset=0.2; color depth'"},
      .parameters = joined(
          {{{"field", file("FIELD").positional().repeatable().requiredOnCommandLine(),
             "Files of fields. A script may leave them out and writes a page of the current field then."},
            {"output", outputFile().as('o').required(), "HTML file of the page."},
            {"title", text("TEXT"), "Title of the page. The default is the names of the fields."},
            {"name", text("TEXT").repeatable(),
             "Name of a field in the page; given once for each field, in their order. The default is the name of its "
             "file, with the name of the folder where files have equal names."},
            {"view", text("LINES"),
             "Lines of a script that describe what the page shows first, as its own 'copy view' and the command "
             "'copy-view' write them; ';' separates them."},
            {"pictures", flag("true").under(kPicture),
             "Adds pictures for browsers without WebGL. --pictures=false leaves them out."}},
           backendParameters()}),
      .action = runPage,
      .check = checkPage,
  });
}

}  // namespace hpsdf::app
