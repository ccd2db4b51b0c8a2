#pragma once
// The report's page: one HTML file beside its pictures = {}; no script, no network.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hpsdf::app {

struct ReportPicture {
  std::string file;  ///< relative to the page
  std::string title;
  std::string caption;
  std::string command;  ///< that makes it
};

struct ReportBar {
  int level;
  double share;  ///< of the domain's volume, 0 to 1
};

struct ReportPage {
  std::string title;
  std::string subtitle;
  std::vector<std::pair<std::string, std::string>> figures = {};
  std::vector<ReportBar> degrees = {};
  std::vector<ReportBar> depths = {};
  std::vector<ReportPicture> pictures = {};
  std::string buildCommand = {};  ///< "" where it is not known
  std::string footer = {};
};

std::string reportHtml(const ReportPage& page);

/// A page's beginning, in the report's style and some more of its own, and its end.
std::string htmlHead(const std::string& title, const std::string& subtitle, std::string_view moreStyle);
std::string htmlFoot(const std::string& footer);

/// The bytes of a PNG file as the source of an <img>, so that it lies in the page.
std::string htmlPng(std::string_view bytes);

/// Text that is safe between tags and in quoted attributes.
std::string htmlEscaped(const std::string& text);

}  // namespace hpsdf::app
