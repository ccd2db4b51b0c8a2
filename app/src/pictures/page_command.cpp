#include <fmt/format.h>
#include <zlib.h>

#include <filesystem>
#include <string>

#include "files/html_page.h"
#include "files/output_folder.h"
#include "files/text_file.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/field_file.h"
#include "hpsdf/web/page_template.h"
#include "pictures/picture_commands.h"
#include "session/field_argument.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Returns the bytes of the field's file.
std::string bytesOf(const Field& field) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "field.hpsdf";
  save(field, file);
  return readWholeFile(file.string());
}

std::string compressed(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                               reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), Z_BEST_COMPRESSION);
  if (status != Z_OK)
    throw Error(ErrorKind::limit, "page", "the field cannot be compressed: there is too little memory");
  result.resize(size);
  return result;
}

void replace(std::string& text, std::string_view mark, std::string_view with) {
  for (std::size_t at = text.find(mark); at != std::string::npos; at = text.find(mark, at + with.size()))
    text.replace(at, mark.size(), with);
}

std::string pageOf(const Field& field, const std::string& title) {
  std::string page(web::pageTemplate());
  replace(page, "{{title}}", htmlEscaped(title));
  replace(page, "{{pictures}}", "");
  replace(page, "{{fields}}",
          fmt::format("<script type=\"application/octet-stream\" class=\"field\" data-name=\"{}\">{}</script>\n",
                      htmlEscaped(title), base64(compressed(bytesOf(field)))));
  return page;
}

void runPage(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  useField(session, arguments);
  const CurrentField& current = session.current();
  if (current.field.data().blend > 0)
    throw Error(ErrorKind::field, current.name,
                "is blended, which pages cannot show yet; build it without continuity exact");
  const std::string page = pageOf(current.field, arguments.textOr("title", plainName(current.name)));
  writeTextFile(file, page);
  std::ostream& out = session.console().out;
  if (session.wantsJson(arguments)) return printJson(out, {{"output", file}, {"file_bytes", page.size()}});
  out << fmt::format("{}: {}, opens in any browser\n", file, bytesText(double(page.size())));
}

}  // namespace

void addPageCommand(Registry& registry) {
  registry.add({
      .name = "page",
      .summary = "Write one HTML file in which a field can be turned, sliced and asked in a browser.",
      .help = paragraphs(R"(
Writes a page that holds the field and all that is needed to draw it by WebGL 2. It needs no network and sends nothing: it can be
mailed, attached to a report, or opened from a disk. The field in it is the one that is stored, and its values are computed in
double precision. Blended fields are refused.

Use it to show a field to somebody who has no hpsdf. The page takes about 0.14 MB besides the field, and the field a third more than
its file.

docs/page.md is the manual.)"),
      .examples = {"hpsdf page bunny.hpsdf -o bunny.html"},
      .parameters = {fieldParameter(),
                     {"output", outputFile().as('o').required(), "HTML file of the page."},
                     {"title", text("TEXT"), "Title of the page. The default is the name of the field's file."}},
      .action = runPage,
      .check = [](const Arguments& arguments) { checkWritable(arguments.text("output")); },
  });
}

}  // namespace hpsdf::app
