#pragma once
// Makes the page that shows fields in a browser: one HTML file with the fields and pictures for browsers without WebGL.

#include <string>
#include <string_view>
#include <vector>

#include "files/html_page.h"
#include "hpsdf/field.h"
#include "hpsdf/render/renderer.h"
#include "language/registry.h"

namespace hpsdf::app {

/// Describes a field in a page, besides the field itself.
struct FieldInPage {
  std::string name;       ///< differs from those of the page's other fields
  std::string view = {};  ///< lines of a script that the page shows at first; "" for its own first view
  std::vector<PagePicture> pictures = {};  ///< shown where the browser has no WebGL or runs no scripts
};

/// A page for a browser, to which fields are added one after the other, so that only one need be in memory.
class FieldPage {
 public:
  /// Adds a field. Throws `Error` for a field that pages cannot show (`refusal`), and if the fields of the page take
  /// too much memory together. Throws `Cancelled` if `progress` says so.
  void add(const Field& field, const FieldInPage& described, const Progress& progress = {});

  /// Returns the HTML file.
  std::string html(const std::string& title) const;

 private:
  double bytes_ = 0;  // of the fields
  std::string fields_;
  std::string pictures_;
};

/// Returns the reason for which pages cannot show the field, or "" if they can.
std::string refusal(const Field& field);

/// Draws small pictures for browsers without WebGL: the surface, and a slice by degree.
std::vector<PagePicture> fallbackPictures(render::Renderer& renderer, const Field& field, const std::string& name);

/// Returns names by which a reader tells files apart: those without folder and extension, those of equal names with the
/// folder in which they lie, and the rest numbered.
std::vector<std::string> distinctNames(const std::vector<std::string>& files);

/// Returns those lines of a view's script that pages understand.
std::string pageView(const std::string& script);

/// Throws `Error` unless the text consists of commands of scripts that describe a view.
void checkPageView(const Registry& registry, std::string_view view);

}  // namespace hpsdf::app
