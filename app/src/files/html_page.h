#pragma once
// Writes the page of a report: one HTML file beside its pictures, without JavaScript of its own and without network
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
  std::string explorer = {};  ///< page that shows the field live, relative to this one; "" for none
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

/// CSS and JavaScript of pages with rows of pictures. The script belongs behind the last row.
extern const std::string_view kPictureRowStyle, kPictureRowScript;

/// CSS of live views: elements of the class `live`, which are not printed.
extern const std::string_view kLiveStyle;

/// Returns a link to a page that shows a field live. Its path is relative to the page with the link.
std::string liveLink(const std::string& page);

/// A picture that a page contains.
struct PagePicture {
  std::string title;
  std::string png;  ///< bytes of a PNG file
};

/// Returns pictures of equal size side by side. A click makes a picture as wide as the page.
std::string pictureRow(const std::vector<PagePicture>& pictures);

/// Returns a slider that shows one picture left of its knob and another one right of it. It belongs directly behind the
/// `pictureRow` whose pictures it shows, first the first two of `names`. If there are more names, the reader chooses
/// two of them.
std::string pictureSlider(const std::vector<std::string>& names);

/// Encodes the bytes of a PNG file as the source of an <img> element, so that the HTML page contains the
/// picture.
std::string htmlPng(std::string_view bytes);

}  // namespace hpsdf::app
