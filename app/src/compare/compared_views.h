#pragma once
// Draws the same views of several fields, with colours that mean the same in all pictures.

#include <string>
#include <vector>

#include "hpsdf/render/picture.h"
#include "session/backend.h"
#include "session/current_field.h"

namespace hpsdf::app {

/// The plane, the camera and the size of the pictures of a comparison.
struct ViewSettings {
  render::AxisPlane plane;
  render::SurfacePicture camera;  ///< camera, size and samples of all pictures
  Backend backend;
};

/// One view with a picture of each field.
struct ComparedView {
  std::string title, caption;
  bool showsLength = false;            ///< true if the colours stand for lengths
  std::string legend = {};             ///< SVG of the common legend; "" for a view without a colour scale
  std::vector<std::string> pngs = {};  ///< bytes of the PNG file of each field's picture
};

struct ComparedViews {
  std::string renderer;
  std::vector<ComparedView> views = {};
};

/// Draws all views of all fields. The views frame `domain`, also where the fields' own domains are larger. Throws
/// `Error` as `render::draw` does.
ComparedViews drawViews(const std::vector<CurrentField>& fields, const DistanceFunction& exact, const Box& domain,
                        const ViewSettings& settings, const Progress& progress);

/// Throws `Error` if the plane lies outside of the domain or the pictures' size is out of range.
void checkViews(const Box& domain, const ViewSettings& settings);

}  // namespace hpsdf::app
