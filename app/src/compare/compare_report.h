#pragma once
// A comparison as text, as JSON and as an HTML page.

#include <string>

#include "compare/compared_views.h"
#include "compare/comparison.h"
#include "text/json.h"

namespace hpsdf::app {

std::string comparisonText(const FieldComparison& comparison);
Json comparisonJson(const FieldComparison& comparison);

/// Returns a page that contains all pictures and needs no network.
std::string comparisonHtml(const FieldComparison& comparison, const ComparedViews& views);

}  // namespace hpsdf::app
