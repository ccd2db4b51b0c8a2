#include "files/html_page.h"

#include <fmt/format.h>

#include <cstdint>

#include "hpsdf/field.h"

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
        levelName(level), htmlEscaped(shareText(share)), 100 * share);
  return fmt::format("<div>\n<h2>{}</h2>\n<table>\n{}</table>\n</div>\n", htmlEscaped(title), rows);
}

std::string figure(const ReportPicture& picture) {
  return fmt::format(
      "<figure>\n<img src=\"{0}\" alt=\"{1}\">\n<figcaption><b>{1}</b>{2}\n<code>{3}</code></figcaption>\n</figure>\n",
      htmlEscaped(picture.file), htmlEscaped(picture.title), htmlEscaped(picture.caption),
      htmlEscaped(picture.command));
}

}  // namespace

std::string htmlPng(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text = "data:image/png;base64,";
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (n + k < bytes.size() ? static_cast<unsigned char>(bytes[n + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += n + k > bytes.size() ? '=' : kDigits[group >> (18 - 6 * k) & 63];
  }
  return text;
}

std::string htmlEscaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

std::string htmlFact(const std::string& name, const std::string& value) {
  return fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", htmlEscaped(name), htmlEscaped(value));
}

std::string htmlHead(const std::string& title, const std::string& subtitle, std::string_view moreStyle) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{0}</title>\n<style>{1}{2}</style>\n</head>\n<body>\n<h1>{0}</h1>\n<p class=\"subtitle\">{3}</p>\n",
      htmlEscaped(title), kStyle, moreStyle, htmlEscaped(subtitle));
}

std::string htmlFoot(const std::string& footer) {
  return fmt::format("<footer>{}</footer>\n</body>\n</html>\n", htmlEscaped(footer));
}

std::string reportHtml(const ReportPage& page) {
  std::string html = htmlHead(page.title, page.subtitle, "");
  html += "<h2>Figures</h2>\n<table>\n";
  for (const auto& [name, value] : page.figures) html += htmlFact(name, value);
  html += "</table>\n";
  if (!page.buildCommand.empty()) html += fmt::format("<code>{}</code>\n", htmlEscaped(page.buildCommand));
  html += "<h2>Pictures</h2>\n";
  for (const ReportPicture& picture : page.pictures) html += figure(picture);
  html += "<div class=\"columns\">\n" + levels("Volume by degree", page.degrees) +
          levels("Volume by depth", page.depths) + "</div>\n";
  return html + htmlFoot(page.footer);
}

}  // namespace hpsdf::app
