#include <fmt/format.h>

#include "check/check.h"
#include "console/version.h"
#include "files/html_page.h"
#include "files/text_file.h"
#include "hpsdf/render/markup.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCheckStyle = R"(
table.items th, table.items td { padding-right: 1.2rem; }
table.items tr.failed td { font-weight: 600; }
td.number { text-align: right; }
h2.failure { margin-top: 3.5rem; padding-top: 1rem; border-top: 3px solid var(--bar); overflow-wrap: anywhere; }
i.color { display: inline-block; width: 1em; height: 1em; margin-right: .4em; border: 1px solid var(--line);
          vertical-align: -.15em; }
.lens { position: fixed; z-index: 1; display: flex; gap: .8rem; padding: .6rem; pointer-events: none; white-space: pre;
        background: var(--paper); border: 1px solid var(--line); border-radius: 4px;
        font: 13px/1.4 "DejaVu Sans Mono", monospace; }
.lens[hidden] { display: none; }
.lens figure { position: relative; margin: 0; }
.lens canvas { display: block; width: 136px; height: 136px; image-rendering: pixelated; }
.lens figure::after { content: ""; position: absolute; top: 64px; left: 64px; width: 8px; height: 8px;
                      outline: 1px solid #f0f; }
)";

// Shows the pixels about the pointer eight times as large, at the same place of all pictures of a row, with the colour
// of each picture's pixel there.
constexpr std::string_view kLensScript = R"(<script>
const lens = document.createElement('div');
lens.className = 'lens';
lens.hidden = true;
document.body.append(lens);
const reach = 8;
function magnified(image, x, y) {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 2 * reach + 1;
  const context = canvas.getContext('2d');
  context.drawImage(image, reach - x, reach - y);
  const color = [...context.getImageData(reach, reach, 1, 1).data.slice(0, 3)];
  const caption = document.createElement('figcaption');
  caption.textContent = '#' + color.map((c) => c.toString(16).padStart(2, '0')).join('');
  const figure = document.createElement('figure');
  figure.append(canvas, caption);
  return figure;
}
function place(event) {
  const { width, height } = lens.getBoundingClientRect();
  const isLow = event.clientY + height + 20 > innerHeight;
  lens.style.left = Math.max(0, Math.min(event.clientX + 20, innerWidth - width)) + 'px';
  lens.style.top = event.clientY + (isLow ? -height - 20 : 20) + 'px';
}
for (const row of document.querySelectorAll('.pictures')) {
  const images = [...row.querySelectorAll('img')];
  row.addEventListener('pointermove', (event) => {
    const image = event.target;
    lens.hidden = !images.includes(image);
    if (lens.hidden) return;
    const box = image.getBoundingClientRect();
    const x = Math.floor((event.clientX - box.left - image.clientLeft) * image.naturalWidth / image.clientWidth);
    const y = Math.floor((event.clientY - box.top - image.clientTop) * image.naturalHeight / image.clientHeight);
    lens.replaceChildren(`x ${x}\ny ${y}`, ...images.map((other) => magnified(other, x, y)));
    place(event);
  });
  row.addEventListener('pointerleave', () => { lens.hidden = true; });
}
</script>
)";

// Loads a live view when a reader opens it: a browser has room for few at a time.
constexpr std::string_view kLiveScript = R"(<script>
for (const details of document.querySelectorAll('details.live'))
  details.addEventListener('toggle', () => {
    const link = details.querySelector('a');
    const frame = document.createElement('iframe');
    frame.src = link.href;
    frame.title = 'the field';
    frame.allow = 'clipboard-write';
    link.before(frame);
  }, { once: true });
</script>
)";

bool isPicture(const fs::path& file) { return lowerExtension(file) == ".png" && fs::exists(file); }

std::string pictures(const CheckedItem& item) {
  std::vector<PagePicture> row;
  const auto add = [&](const std::string& title, const fs::path& file) {
    if (isPicture(file)) row.push_back({title, readWholeFile(file.string())});
  };
  add("Baseline", item.baseline);
  add("Actual", item.actual);
  add("Difference: dark grey is free, from mid grey to white counts", item.difference);
  const std::string html = pictureRow(row);
  return isPicture(item.difference) ? html + pictureSlider({"the baseline", "the actual picture"}) : html;
}

std::string swatch(const std::string& value) {
  const std::string color = value.starts_with('#') ? fmt::format("<i class=\"color\" style=\"background:{}\"></i>",
                                                                 render::escapedMarkup(value))
                                                   : std::string();
  return color + render::escapedMarkup(value);
}

std::string worstDifferences(const CheckedItem& item) {
  if (item.worst.empty()) return {};
  std::string html =
      "<table>\n<tr><th>The worst, from the top left</th><th>baseline</th><th>actual</th><th>difference</th></tr>\n";
  for (const WorstDifference& worst : item.worst)
    html +=
        fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", render::escapedMarkup(worst.position),
                    swatch(worst.baseline), swatch(worst.actual), render::escapedMarkup(worst.difference));
  return html + "</table>\n";
}

std::string shareText(const CheckedItem& item) {
  if (item.compared == 0) return {};
  return fmt::format("{} of {} ({:.3g} %), of which {:.3g} % are free; the largest difference is {:.3g}",
                     grouped(item.differing), grouped(item.compared),
                     100 * double(item.differing) / double(item.compared), 100 * item.budget, item.largest);
}

/// Returns the command line that repeats the check, without the option --only.
std::string checkCommand(const CheckRequest& request) {
  std::string line = "hpsdf check " + shellWord(request.folder.string());
  for (const auto& [name, value] : request.variables) line += " " + shellWord(name + "=" + value);
  return line + " --out " + shellWord(request.output.string());
}

std::string failure(const CheckedItem& item, const CheckRequest& request) {
  std::string html = fmt::format("<h2 class=\"failure\">{}: {}</h2>\n<p>{}</p>\n", render::escapedMarkup(item.title()),
                                 verdictText(item.verdict), render::escapedMarkup(item.problem));
  html += pictures(item);
  if (!item.live.empty())
    html += "<details class=\"live\">\n<summary>Look into the field that drew the actual picture</summary>\n" +
            liveLink(item.live.string()) + "</details>\n";
  html += worstDifferences(item);
  const std::pair<const char*, std::string> facts[] = {{"Differing", shareText(item)},
                                                       {"Written by", item.where},
                                                       {"Renderer of the baseline", item.baselineRenderer},
                                                       {"Renderer now", item.renderer}};
  html += "<table>\n";
  for (const auto& [name, value] : facts)
    if (!value.empty()) html += htmlFact(name, value);
  html += fmt::format("</table>\n<code>{} --only {}</code>\n", render::escapedMarkup(checkCommand(request)),
                      render::escapedMarkup(shellWord(item.script)));
  const bool canBeAccepted = item.controlLine == 0 && !item.picture.empty() && fs::exists(item.actual);
  if (canBeAccepted)
    html += fmt::format(
        "<p>If it is right now:</p>\n<code>{}</code>\n",
        render::escapedMarkup(fmt::format("hpsdf accept {} --from {} {}", shellWord(request.folder.string()),
                                          shellWord(request.output.string()), shellWord(item.name()))));
  return html;
}

std::string overview(const CheckOutcome& outcome) {
  std::string html =
      "<table class=\"items\">\n<tr><th>Script</th><th>Picture</th><th>Result</th><th>Differing</th><th>Largest "
      "difference</th></tr>\n";
  for (const CheckedItem& item : outcome.items)
    html += fmt::format(
        "<tr{}><td>{}</td><td>{}</td><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{:.3g}</td></tr>\n",
        item.verdict == Verdict::passed ? "" : " class=\"failed\"", render::escapedMarkup(item.script),
        render::escapedMarkup(item.pictureText()), verdictText(item.verdict), grouped(item.differing), item.largest);
  return html + "</table>\n";
}

/// Escapes text for XML. Control characters and invalid UTF-8, which XML does not allow, are replaced.
std::string xmlText(const std::string& text) {
  std::string printable = text;
  for (char& c : printable)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  return render::escapedMarkup(Json::parse(jsonLine(printable)).get<std::string>());
}

std::string junitCase(const CheckedItem& item) {
  const std::string begin =
      fmt::format("    <testcase classname=\"{}\" name=\"{}\"", xmlText(item.script), xmlText(item.pictureText()));
  if (item.verdict == Verdict::passed) return begin + "/>\n";
  const char* kind = item.verdict == Verdict::scriptFailed ? "error" : "failure";
  return fmt::format("{}>\n      <{} type=\"{}\" message=\"{}\"/>\n    </testcase>\n", begin, kind,
                     verdictText(item.verdict), xmlText(item.problem));
}

}  // namespace

std::string checkHtml(const CheckOutcome& outcome, const CheckRequest& request) {
  const std::size_t failures = outcome.failures();
  const std::string subtitle = failures == 0
                                   ? fmt::format("All {} comparisons are as they should be", outcome.items.size())
                                   : fmt::format("{} of {} comparisons failed", failures, outcome.items.size());
  std::string html = htmlHead("Check of " + request.folder.string(), subtitle,
                              std::string(kPictureRowStyle) + std::string(kLiveStyle) + std::string(kCheckStyle));
  html += "<h2>All comparisons</h2>\n" + overview(outcome);
  html += fmt::format("<code>{}</code>\n", render::escapedMarkup(checkCommand(request)));
  for (const CheckedItem& item : outcome.items)
    if (item.verdict != Verdict::passed) html += failure(item, request);
  return html + std::string(kPictureRowScript) + std::string(kLensScript) + std::string(kLiveScript) +
         htmlFoot(versionText());
}

std::string junitXml(const CheckOutcome& outcome) {
  std::map<std::string, std::vector<const CheckedItem*>> suites;
  for (const auto& [script, seconds] : outcome.seconds) suites[script];
  for (const CheckedItem& item : outcome.items) suites[item.script].push_back(&item);
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"hpsdf check\">\n";
  for (const auto& [script, items] : suites) {
    std::string cases;
    std::size_t failures = 0, errors = 0;
    for (const CheckedItem* item : items) {
      cases += junitCase(*item);
      errors += item->verdict == Verdict::scriptFailed ? 1 : 0;
      failures += item->verdict != Verdict::passed && item->verdict != Verdict::scriptFailed ? 1 : 0;
    }
    const auto seconds = outcome.seconds.find(script);
    xml += fmt::format(
        "  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" time=\"{:.3f}\">\n{}"
        "  </testsuite>\n",
        xmlText(script), items.size(), failures, errors, seconds == outcome.seconds.end() ? 0 : seconds->second, cases);
  }
  return xml + "</testsuites>\n";
}

}  // namespace hpsdf::app
