#include "files/html_page.h"

#include <fmt/format.h>

#include <cstdint>

#include "hpsdf/field.h"
#include "hpsdf/render/markup.h"

namespace hpsdf::app {
namespace {

constexpr std::string_view kStyle = R"(
:root { color-scheme: light dark; --paper: #fbfbf9; --ink: #1c2024; --quiet: #626a73; --line: #dcdfe3; --bar: #3b76b5;
        --code: #f0f1ee; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #16181b; --ink: #e4e6e8; --quiet: #98a1aa; --line: #33383e; --bar: #6ba3dd; --code: #202429; }
}
body { margin: 0 auto; max-width: 78rem; padding: 2.5rem 1.5rem; background: var(--paper); color: var(--ink);
       font: 16px/1.55 system-ui, "DejaVu Sans", sans-serif; }
h1 { margin: 0; font-size: 1.9rem; line-height: 1.2; }
h2 { margin: 2.6rem 0 .8rem; font-size: 1.2rem; }
p.subtitle { margin: .4rem 0 0; color: var(--quiet); }
.columns { display: grid; grid-template-columns: repeat(auto-fit, minmax(20rem, 1fr)); gap: 0 3rem; }
table { width: 100%; border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .32rem 0; border-bottom: 1px solid var(--line); text-align: left; vertical-align: top;
         font-weight: normal; }
th { padding-right: 1.5rem; color: var(--quiet); }
td { overflow-wrap: anywhere; }
td.bar { width: 60%; }
td.bar span { display: block; height: .7rem; margin-top: .45rem; min-width: 1px; background: var(--bar); }
td.share { padding-right: 1rem; text-align: right; white-space: nowrap; }
figure { margin: 0 0 2.4rem; }
figure img { display: block; max-width: 100%; height: auto; border: 1px solid var(--line); border-radius: 4px; }
figcaption { margin-top: .6rem; }
figcaption b { display: block; }
code { display: block; margin-top: .4rem; padding: .45rem .7rem; overflow-x: auto; background: var(--code);
       border-radius: 4px; font: 13px/1.5 "DejaVu Sans Mono", monospace; white-space: pre; }
footer { margin-top: 3rem; padding-top: .8rem; border-top: 1px solid var(--line); color: var(--quiet);
         font-size: .9rem; }
)";

std::string shareText(double share) {
  return share > 0 && share < 0.5e-4 ? "<0.01 %" : fmt::format("{:.2f} %", 100 * share);
}

std::string levels(const std::string& title, const std::map<int, double>& shares) {
  std::string rows;
  for (const auto& [level, share] : shares)
    rows += fmt::format(
        "<tr><th>{}</th><td class=\"share\">{}</td><td class=\"bar\"><span "
        "style=\"width:{:.2f}%\"></span></td></tr>\n",
        levelName(level), render::escapedMarkup(shareText(share)), 100 * share);
  return fmt::format("<div>\n<h2>{}</h2>\n<table>\n{}</table>\n</div>\n", render::escapedMarkup(title), rows);
}

/// Returns a path as an address in HTML.
std::string addressOf(const std::string& path) {
  std::string address;
  for (const char c : path) {
    const bool isPlain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                         std::string_view("-._~/").find(c) != std::string_view::npos;
    address += isPlain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return address;
}

std::string figure(const ReportPicture& picture) {
  return fmt::format(
      "<figure>\n<img src=\"{0}\" alt=\"{1}\">\n<figcaption><b>{1}</b>{2}\n<code>{3}</code></figcaption>\n</figure>\n",
      render::escapedMarkup(picture.file), render::escapedMarkup(picture.title), render::escapedMarkup(picture.caption),
      render::escapedMarkup(picture.command));
}

}  // namespace

const std::string_view kLiveStyle = R"(
.live { margin: 1.6rem 0; }
.live summary { cursor: pointer; }
.live iframe { display: block; width: 100%; aspect-ratio: 16 / 10; min-height: 22rem; margin: .5rem 0;
               box-sizing: border-box; border: 1px solid var(--line); border-radius: 4px; }
@media print { .live { display: none; } }
)";

std::string liveLink(const std::string& page) {
  return fmt::format("<a href=\"{}\">open alone</a>\n", addressOf(page));
}

const std::string_view kPictureRowStyle = R"(
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(18rem, 1fr)); gap: 0 1rem; }
.pictures figure { margin-bottom: 1rem; }
.pictures img { cursor: zoom-in; }
.pictures figure.wide { grid-column: 1 / -1; }
.pictures figure.wide img { width: 100%; cursor: zoom-out; image-rendering: pixelated; }
.slider { display: none; margin: .5rem 0 1rem; }
.slider .shown { position: relative; }
.slider img { display: block; width: 100%; border: 1px solid var(--line); border-radius: 4px; box-sizing: border-box; }
.slider img.over { position: absolute; top: 0; left: 0; clip-path: inset(0 0 0 50%); }
.slider input { width: 100%; margin: .5rem 0 0; }
.ends { display: flex; justify-content: space-between; color: var(--quiet); font-size: .9rem; }
.ends select { font: inherit; }
)";

// Copies two pictures of the row into the slider behind it, so that the page contains every picture only once.
const std::string_view kPictureRowScript = R"(<script>
for (const slider of document.querySelectorAll('.slider')) {
  const [under, over] = slider.querySelectorAll('img');
  const images = slider.previousElementSibling.querySelectorAll('img');
  const chosen = slider.querySelectorAll('select');
  const show = () => {
    under.src = images[chosen.length ? chosen[0].value : 0].src;
    over.src = images[chosen.length ? chosen[1].value : 1].src;
  };
  for (const choice of chosen) choice.onchange = show;
  show();
  slider.style.display = 'block';
  slider.querySelector('input').oninput = (event) => {
    over.style.clipPath = 'inset(0 0 0 ' + event.target.value + '%)';
  };
}
for (const image of document.querySelectorAll('.pictures img'))
  image.onclick = () => image.parentElement.classList.toggle('wide');
</script>
)";

std::string pictureRow(const std::vector<PagePicture>& pictures) {
  std::string html = "<div class=\"pictures\">\n";
  for (const PagePicture& picture : pictures)
    html += fmt::format("<figure><img src=\"{0}\" alt=\"{1}\"><figcaption>{1}</figcaption></figure>\n",
                        htmlPng(picture.png), render::escapedMarkup(picture.title));
  return html + "</div>\n";
}

std::string pictureSlider(const std::vector<std::string>& names) {
  const auto side = [&](std::size_t shown) {
    if (names.size() == 2) return render::escapedMarkup(names[shown]);
    std::string options;
    for (std::size_t n = 0; n < names.size(); ++n)
      options += fmt::format("<option value=\"{}\"{}>{}</option>", n, n == shown ? " selected" : "",
                             render::escapedMarkup(names[n]));
    return "<select>" + options + "</select>";
  };
  return fmt::format(
      "<div class=\"slider\"><div class=\"shown\"><img alt=\"left picture\"><img class=\"over\" alt=\"right "
      "picture\"></div><input type=\"range\" min=\"0\" max=\"100\" step=\"0.1\" value=\"50\" aria-label=\"how much of "
      "the left picture is seen\"><div class=\"ends\"><span>left of the knob {}</span><span>right of it "
      "{}</span></div></div>\n",
      side(0), side(1));
}

std::string htmlPng(std::string_view bytes) { return "data:image/png;base64," + render::base64(bytes); }

std::string htmlFact(const std::string& name, const std::string& value) {
  return fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", render::escapedMarkup(name), render::escapedMarkup(value));
}

std::string htmlHead(const std::string& title, const std::string& subtitle, std::string_view moreStyle) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{0}</title>\n<style>{1}{2}</style>\n</head>\n<body>\n<h1>{0}</h1>\n<p class=\"subtitle\">{3}</p>\n",
      render::escapedMarkup(title), kStyle, moreStyle, render::escapedMarkup(subtitle));
}

std::string htmlFoot(const std::string& footer) {
  return fmt::format("<footer>{}</footer>\n</body>\n</html>\n", render::escapedMarkup(footer));
}

std::string reportHtml(const ReportPage& page) {
  std::string html = htmlHead(page.title, page.subtitle, kLiveStyle);
  if (!page.explorer.empty())
    html += fmt::format(
        "<div class=\"live\">\n<iframe src=\"{}\" title=\"the field\" loading=\"lazy\" "
        "allow=\"clipboard-write\"></iframe>\n{}</div>\n",
        addressOf(page.explorer), liveLink(page.explorer));
  html += "<h2>Figures</h2>\n<table>\n";
  for (const auto& [name, value] : page.figures) html += htmlFact(name, value);
  html += "</table>\n";
  if (!page.buildCommand.empty()) html += fmt::format("<code>{}</code>\n", render::escapedMarkup(page.buildCommand));
  html += "<h2>Pictures</h2>\n";
  for (const ReportPicture& picture : page.pictures) html += figure(picture);
  html += "<div class=\"columns\">\n" + levels("Volume by degree", page.degrees) +
          levels("Volume by depth", page.depths) + "</div>\n";
  return html + htmlFoot(page.footer);
}

}  // namespace hpsdf::app
