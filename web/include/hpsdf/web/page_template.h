#pragma once
// The HTML page that shows a field in a browser (docs/page.md), without its field.

#include <string_view>

namespace hpsdf::web {

/// Returns the page, in which {{title}} stands for the page's title, escaped as HTML, and {{field}} for the field: a
/// `.hpsdf` file without compressed arrays, compressed by zlib and written in base64. It loads nothing from anywhere.
std::string_view pageTemplate();

}  // namespace hpsdf::web
