#pragma once
// Text and bytes as SVG and HTML hold them.

#include <string>
#include <string_view>

namespace hpsdf::render {

/// Escapes text for use between tags and in quoted attributes.
std::string escapedMarkup(std::string_view text);

/// Returns bytes in base64 (RFC 4648).
std::string base64(std::string_view bytes);

}  // namespace hpsdf::render
