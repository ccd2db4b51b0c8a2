#pragma once
// A comparison as text, as JSON and as an HTML page.

#include <string>

#include "compare/compared_views.h"
#include "compare/comparison.h"
#include "text/json.h"

namespace hpsdf::app {

std::string comparisonText(const Comparison& comparison);
Json comparisonJson(const Comparison& comparison);

/// Returns a page that contains all pictures and needs no network.
std::string comparisonHtml(const Comparison& comparison, const ComparedViews& views);

}  // namespace hpsdf::app
