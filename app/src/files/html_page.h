#pragma once
// Writes the page of a report: one HTML file beside its pictures, without JavaScript and without network
// access.

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hpsdf::app {

struct ReportPicture {
  std::string file;  ///< file name relative to the page
  std::string title;
  std::string caption;
  std::string command;  ///< command that draws the picture
};

struct ReportPage {
  std::string title;
  std::string subtitle;
  std::vector<std::pair<std::string, std::string>> figures = {};
  std::map<int, double> degrees = {};  ///< share of the domain's volume by degree, 0 to 1
  std::map<int, double> depths = {};
  std::vector<ReportPicture> pictures = {};
  std::string buildCommand = {};  ///< "" if the command is unknown
  std::string footer = {};
};

std::string reportHtml(const ReportPage& page);

/// Returns the beginning of an HTML page; `htmlFoot` returns its end. `moreStyle` is CSS that is added to the CSS of
/// reports.
std::string htmlHead(const std::string& title, const std::string& subtitle, std::string_view moreStyle);
std::string htmlFoot(const std::string& footer);

/// Returns a row of an HTML table with a name and its value. The function escapes both texts.
std::string htmlFact(const std::string& name, const std::string& value);

/// Encodes the bytes of a PNG file as the source of an <img> element, so that the HTML page contains the
/// picture.
std::string htmlPng(std::string_view bytes);

/// Escapes text for use between tags and in quoted attributes.
std::string htmlEscaped(const std::string& text);

}  // namespace hpsdf::app
