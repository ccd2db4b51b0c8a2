#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "cpu/trace.h"
#include "hpsdf/error.h"
#include "hpsdf/render/renderer.h"
#include "view/view_buffers.h"
#include "view/view_checks.h"

namespace hpsdf::render {
namespace {

bool isInDomain(const Vector3& p, const Vector3& grid) {
  return (p.array() >= 0).all() && (p.array() <= grid.array()).all();
}

/// The part of a pixel's ray within the visible part of the domain.
struct VisiblePart {
  Ray ray;
  double fromEye;  ///< distance from the start of the pixel's ray to the origin of `ray`, world units
};

/// Clips a ray, given in grid coordinates, to the visible part of the domain. Returns std::nullopt if the ray misses
/// that part.
std::optional<VisiblePart> visiblePart(const RayGeometry& rays, const Vector3& eye, const Vector3& direction) {
  double first = 0;
  double last = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double toLo = (rays.lo[axis] - eye[axis]) / direction[axis];
    const double toHi = (rays.hi[axis] - eye[axis]) / direction[axis];
    if (direction[axis] != 0) {
      first = std::max(first, std::min(toLo, toHi));
      last = std::min(last, std::max(toLo, toHi));
    } else if (!(eye[axis] >= rays.lo[axis] && eye[axis] <= rays.hi[axis])) {
      return std::nullopt;
    }
  }
  if (!(first < last)) return std::nullopt;
  return VisiblePart{{eye + first * direction, direction, last - first}, first};
}

class CpuRenderer final : public Renderer {
 public:
  explicit CpuRenderer(const Field& field) : field_(field) {}

  ViewBuffers slice(const SliceView& view, int width, int height) override {
    const SliceGeometry geometry(field_.space(), view, width, height);
    ViewBuffers buffers = emptyBuffers(width, height, false);
    tbb::parallel_for(0, height, [&](int y) {
      for (int x = 0; x < width; ++x) slicePixel(geometry, x, y, buffers);
    });
    return buffers;
  }

  ViewBuffers surface(const SurfaceView& view, int width, int height, std::span<const std::uint8_t> chosen) override {
    checkOffset(view.offset);
    checkChosen(chosen, width, height);
    field_.prepareTracing();
    const RayGeometry geometry(field_.space(), view.camera, width, height, view.clip);
    ViewBuffers buffers = emptyBuffers(width, height, true);
    tbb::parallel_for(0, height, [&](int y) {
      for (int x = 0; x < width; ++x)
        if (chosen.empty() || chosen[std::size_t(y) * width + x] != 0)
          surfacePixel(geometry, view.offset, x, y, buffers);
    });
    return buffers;
  }

  std::string description() const override { return "CPU, double precision"; }

 private:
  void slicePixel(const SliceGeometry& geometry, int x, int y, ViewBuffers& buffers) const {
    const Vector3 p = geometry.point(x, y);
    if (!isInDomain(p, field_.space().grid)) return;
    const CellPoint at = field_.leafAt(p);
    const std::size_t pixel = std::size_t(y) * buffers.width + x;
    setCell(at, pixel, buffers);
    buffers.value[pixel] = static_cast<float>(field_.value(at, 2 * at.fraction - Vector3::Ones()));
  }

  void surfacePixel(const RayGeometry& geometry, double offset, int x, int y, ViewBuffers& buffers) const {
    const Vector3 direction = geometry.direction(x, y);
    const auto part = visiblePart(geometry, geometry.start(x, y), direction.cwiseProduct(geometry.scale));
    if (!part) return;
    const auto hit = field_.trace(part->ray, offset);
    if (!hit) return;
    const std::size_t pixel = std::size_t(y) * buffers.width + x;
    setCell(hit->cell, pixel, buffers);
    const Sample sample = field_.sample(*hit);
    const Vector3 gradient = field_.worldGradient(sample.gradient, hit->cell.depth);
    const double length = gradient.norm();
    // A cell of degree 0 has no gradient; its normal points to the eye.
    buffers.normal[pixel] = (length > 0 ? Vector3(gradient / length) : Vector3(-direction)).cast<float>();
    buffers.value[pixel] = static_cast<float>(sample.value);
    buffers.distance[pixel] = static_cast<float>(part->fromEye + hit->t);
    const double step = std::abs(sample.value - offset);
    buffers.crack[pixel] = hit->onFace && step > kCrack * field_.space().diagonal * std::max(1.0, length);
  }

  void setCell(const CellPoint& at, std::size_t pixel, ViewBuffers& buffers) const {
    buffers.cell[pixel] = at.node;
    buffers.degree[pixel] = static_cast<std::uint8_t>(field_.degree(at.node));
    buffers.depth[pixel] = static_cast<std::uint8_t>(at.depth);
  }

  TraceField field_;
};

}  // namespace

std::unique_ptr<Renderer> makeCpuRenderer(const Field& field) { return std::make_unique<CpuRenderer>(field); }

}  // namespace hpsdf::render
