#include "compare/compared_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "pictures/legends.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

using render::ColorBy;

struct ViewKind {
  bool isSlice;
  ColorBy color;
  const char *title, *caption;
};
constexpr ViewKind kComparedViews[] = {
    {true, ColorBy::degree, "Degree", "The degree of each cell's polynomial, or exact for a list of triangles"},
    {true, ColorBy::error, "Error", "The absolute difference from the exact distance"},
    {false, ColorBy::normal, "Surface", "Sphere-traced, lit by the field's own gradient; cracks are marked"},
    {false, ColorBy::error, "Error on the surface", "How far the field's surface lies from the exact one"}};

/// Draws one field. Frames the views alike for fields with different domains.
class FieldView {
 public:
  FieldView(const Field& field, const DistanceFunction& exact, const Box& domain, const ViewSettings& settings)
      : field_(field), settings_(settings), renderer_(makeRenderer(field, settings.backend)) {
    reference_.exact = &exact;
    const int width = settings.camera.width, height = settings.camera.height;
    const auto& [axis, offset] = settings.plane;
    const render::SliceView shown = render::axisSlice(domain, axis, offset, width, height);
    const render::SliceView whole = render::axisSlice(field.domain(), axis, offset, width, height);
    target_ = shown.origin;
    zoom_ = whole.right.norm() / shown.right.norm();
    camera_ = settings.camera.camera;
    if (!camera_.target) camera_.target = domain.center();
    camera_.distance *= domain.diagonal().norm() / field.domain().diagonal().norm();
  }

  render::Drawn draw(const ViewKind& kind, const render::ScaleOptions& scale, int samples) {
    return kind.isSlice ? drawPlane(kind, scale, samples) : drawCamera(kind, scale, samples);
  }
  std::string renderer() const { return renderer_->description(); }

 private:
  render::Drawn drawPlane(const ViewKind& kind, const render::ScaleOptions& scale, int samples) {
    const render::SlicePicture picture{.plane = settings_.plane,
                                       .color = kind.color,
                                       .width = settings_.camera.width,
                                       .height = settings_.camera.height,
                                       .samples = samples,
                                       .scale = scale,
                                       .bare = true,
                                       .zoom = zoom_,
                                       .target = target_};
    return render::drawSlice(*renderer_, field_, picture, reference_);
  }

  render::Drawn drawCamera(const ViewKind& kind, const render::ScaleOptions& scale, int samples) {
    render::SurfacePicture picture = settings_.camera;
    picture.camera = camera_;
    picture.color = kind.color;
    picture.scale = scale;
    picture.samples = samples;
    picture.cracks = kind.color == ColorBy::normal;
    picture.bare = true;
    return render::drawSurface(*renderer_, field_, picture, reference_);
  }

  const Field& field_;
  const ViewSettings& settings_;
  std::unique_ptr<render::Renderer> renderer_;
  render::ReferenceData reference_;
  render::OrbitCamera camera_;
  Vector3 target_;
  double zoom_;
};

/// Extends a colour scale so that it holds the values of another one.
void widen(render::ScaleOptions& scale, const render::ScaleOptions& other) {
  if (scale.limits && other.limits)
    scale.limits = {std::min((*scale.limits)[0], (*other.limits)[0]), std::max((*scale.limits)[1], (*other.limits)[1])};
  else if (other.limits)
    scale.limits = other.limits;
  scale.levels.insert(scale.levels.end(), other.levels.begin(), other.levels.end());
  std::ranges::sort(scale.levels);
  scale.levels.erase(std::unique(scale.levels.begin(), scale.levels.end()), scale.levels.end());
}

std::string legendOf(const render::Legend& legend) {
  if (!legend.levels.empty()) return levelsSvg(levelColors(legend));
  return legend.bar.empty() ? "" : barSvg(legend);
}

std::string titleOf(const ViewKind& kind, const render::AxisPlane& plane) {
  return kind.isSlice ? fmt::format("{} in the plane {} = {}", kind.title, "xyz"[plane.axis], shortNumber(plane.offset))
                      : kind.title;
}

}  // namespace

ComparedViews drawViews(const std::vector<CurrentField>& fields, const DistanceFunction& exact, const Box& domain,
                        const ViewSettings& settings, const Progress& progress) {
  std::vector<FieldView> drawers;
  for (const CurrentField& current : fields) drawers.emplace_back(current.field, exact, domain, settings);
  ComparedViews result{.renderer = drawers.front().renderer()};
  double done = 0;
  const double all = 2 * double(fields.size() * std::size(kComparedViews));
  for (const ViewKind& kind : kComparedViews) {
    // Draw each field with a scale of its own, to find the scale that suits all of them.
    render::ScaleOptions scale;
    for (FieldView& drawer : drawers) {
      progress.update("choosing colours", done++ / all);
      widen(scale, drawer.draw(kind, {}, 1).scale);
    }
    ComparedView view{
        .title = titleOf(kind, settings.plane), .caption = kind.caption, .showsLength = kind.color == ColorBy::error};
    for (FieldView& drawer : drawers) {
      progress.update("drawing", done++ / all);
      const render::Drawn drawn = drawer.draw(kind, scale, settings.camera.samples);
      view.pngs.push_back(pngBytes(drawn.image));
      view.legend = legendOf(drawn.legend);
    }
    result.views.push_back(std::move(view));
  }
  return result;
}

void checkViews(const Box& domain, const ViewSettings& settings) {
  const render::SurfacePicture& camera = settings.camera;
  render::checkPictureSize(camera.width, camera.height, camera.samples);
  render::axisSlice(domain, settings.plane.axis, settings.plane.offset, camera.width, camera.height);
  render::cameraOf(camera.camera, domain, camera.width, camera.height);
}

}  // namespace hpsdf::app
