#include "grids/xml_tags.h"

#include <utility>

#include "hpsdf/detail/text.h"
#include "util/refuse.h"

namespace hpsdf::grids {
namespace {

constexpr std::size_t kMostAttributes = 100;

/// The things that stand between elements, each with its beginning behind "<" and its end.
constexpr std::pair<std::string_view, std::string_view> kBetweenElements[] = {
    {"!--", "-->"}, {"![CDATA[", "]]>"}, {"!", ">"}, {"?", "?>"}, {"/", ">"}};

/// Removes a comment, a declaration, character data or the end of an element from the beginning of the text behind "<".
/// Returns false if it begins with something else.
bool skipBetweenElements(std::string_view& text) {
  for (const auto& [begin, end] : kBetweenElements) {
    if (!text.starts_with(begin)) continue;
    const std::size_t at = text.find(end, begin.size());
    if (at == std::string_view::npos)
      detail::refuse("the file ends before '", end, "', which must follow '<", begin, "'");
    text.remove_prefix(at + end.size());
    return true;
  }
  return false;
}

/// Removes an attribute from the beginning of the text, and adds it to the element.
void takeAttribute(std::string_view& text, Tag& tag) {
  const std::string_view key = trimmed(takeUntil(text, "=>"));
  takeUntil(text, "\"'>");
  const std::size_t end = text.empty() ? std::string_view::npos : text.find(text[0], 1);
  if (text.empty() || text[0] == '>' || end == std::string_view::npos)
    detail::refuse("expected ", shownText(key), "=\"…\" in <", shownText(tag.name), ">");
  tag.attributes[key] = text.substr(1, end - 1);
  if (tag.attributes.size() > kMostAttributes)
    detail::refuse("<", shownText(tag.name), "> has more than ", kMostAttributes, " attributes");
  text.remove_prefix(end + 1);
}

}  // namespace

std::string_view takeUntil(std::string_view& text, std::string_view ends) {
  const std::string_view taken = text.substr(0, text.find_first_of(ends));
  text.remove_prefix(taken.size());
  return taken;
}

Tag nextTag(std::string_view text) {
  do {
    takeUntil(text, "<");
    if (text.empty()) return {};
    text.remove_prefix(1);
  } while (skipBetweenElements(text));
  Tag tag{takeUntil(text, " \t\r\n/>"), {}, {}};
  while (!(text = trimmed(text)).empty() && text[0] != '>') {
    if (text[0] == '/')
      text.remove_prefix(1);
    else
      takeAttribute(text, tag);
  }
  if (text.empty()) detail::refuse("the file ends within <", shownText(tag.name), ">");
  tag.rest = text.substr(1);
  return tag;
}

}  // namespace hpsdf::grids
