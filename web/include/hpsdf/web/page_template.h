#pragma once
// The HTML page that shows fields in a browser (docs/page.md), without its fields.

#include <string_view>

namespace hpsdf::web {

/// Returns the page. It loads nothing from anywhere. Four marks in it stand for what has to be filled in:
/// * {{title}}: the page's title, escaped as HTML;
/// * {{pictures}}: figures that a browser shows if it cannot draw the fields;
/// * {{fields}}: for each field an element `<script type="application/octet-stream" class="field" data-name="NAME">`
/// with
///   a `.hpsdf` file without compressed arrays, compressed by zlib and written in base64. An attribute `data-view` may
///   hold lines of a script that the page shows first;
/// * {{program}}: `pageProgram()`, compressed by zlib and written in base64.
std::string_view pageTemplate();

/// Returns the elements that the page adds to itself when it is opened: the shaders and the script.
std::string_view pageProgram();

}  // namespace hpsdf::web
