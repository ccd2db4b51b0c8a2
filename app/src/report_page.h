#pragma once
// The report's page: one HTML file beside its pictures = {}; no script, no network.

#include <string>
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

/// Text that is safe between tags and in quoted attributes.
std::string htmlEscaped(const std::string& text);

}  // namespace hpsdf::app
