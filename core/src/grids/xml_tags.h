#pragma once
// The elements of XML files, as far as files of VTK need them.

#include <map>
#include <string_view>

namespace hpsdf::grids {

/// The beginning of an element: its name, its attributes as they are written, and the text that follows it. All of them
/// refer to the file's text.
struct Tag {
  std::string_view name;
  std::map<std::string_view, std::string_view> attributes;
  std::string_view rest;

  /// Returns the value of an attribute, or an empty text if the element has none with this name.
  std::string_view attribute(std::string_view key) const {
    const auto found = attributes.find(key);
    return found == attributes.end() ? std::string_view() : found->second;
  }
};

/// Returns the beginning of the next element, or one without a name at the end of the text. Passes over comments,
/// declarations, character data and the ends of elements. Throws `Error` with the problem alone if one of them is not
/// closed, or if an element has a damaged attribute or more than a hundred of them.
Tag nextTag(std::string_view text);

/// Returns the text up to the first of the characters `ends`, and removes it from `text`.
std::string_view takeUntil(std::string_view& text, std::string_view ends);

}  // namespace hpsdf::grids
