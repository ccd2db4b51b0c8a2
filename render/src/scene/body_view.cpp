#include "scene/body_view.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "hpsdf/error.h"
#include "image/color.h"
#include "view/view_checks.h"

namespace hpsdf::render {
namespace {

constexpr std::size_t kMostPixels = std::size_t{1} << 26;
constexpr double kLeastDepth = 1e-5;  // least visible depth in perspective, as a share of the farthest depth

}  // namespace

Color bodyColor(std::size_t index) {
  // The hues of bodies run from green over blue to pink, far from the orange of clay. Consecutive hues differ by
  // a golden section of that range. Three lightnesses alternate.
  constexpr double kFirstHue = 125, kHues = 225, kChroma = 0.11;
  constexpr double kLightness[] = {0.66, 0.78, 0.56};
  const double turns = 0.6180339887498949 * double(index % 1000000);
  return encodeSrgb(fromOklch(kLightness[index % 3], kChroma, kFirstHue + kHues * (turns - std::floor(turns))));
}

// The destructor is defined here so that only this library contains the virtual table of the class.
BodyRenderer::~BodyRenderer() = default;

void checkBodyView(const Camera& camera, int width, int height) {
  checkCamera(camera, width, height);
  if (std::size_t(width) * std::size_t(height) > kMostPixels)
    throw Error("a view of " + std::to_string(width) + "x" + std::to_string(height) +
                " pixels is more than the 64 million that bodies are drawn in: give a smaller one");
  if (camera.right.isZero(0) || camera.up.isZero(0))
    throw Error("a camera's right or up vector is zero: give half the view's width and height");
}

double farthestDepth(const Camera& camera, const Box& box) {
  double farthest = 0;
  for (int i = 0; i < 8; ++i)
    farthest = std::max(farthest, (box.corner(Box::CornerType(i)) - camera.eye).dot(camera.forward));
  return farthest > 0 ? farthest : 1;
}

double leastDepth(const Camera& camera, double farthest) {
  return camera.projection == Projection::perspective ? kLeastDepth * farthest : 0;
}

BodyBuffers emptyBodyBuffers(int width, int height) {
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  BodyBuffers buffers{.width = width, .height = height, .body = {}, .triangle = {}, .normal = {}, .distance = {}};
  buffers.body.assign(pixels, kNoBody);
  buffers.triangle.assign(pixels, 0);
  buffers.normal.assign(pixels, Eigen::Vector3f::Zero());
  buffers.distance.assign(pixels, 0);
  return buffers;
}

void showBody(const BodyMeshes& meshes, std::span<const Body> bodies, const BodyPoint& point, std::size_t pixel,
              BodyBuffers& buffers) {
  const Body& body = bodies[point.body];
  const Vector3 normal = body.worldFromBody.linear() * meshes[body.mesh].normal(point.triangle, point.barycentric);
  buffers.body[pixel] = point.body;
  buffers.triangle[pixel] = point.triangle;
  buffers.normal[pixel] = (point.fromBehind ? Vector3(-normal) : normal).cast<float>();
  buffers.distance[pixel] = static_cast<float>(point.distance);
}

void addBodies(const BodyBuffers& bodies, ViewBuffers& buffers) {
  buffers.body.assign(buffers.cell.size(), kNoBody);
  for (std::size_t i = 0; i < buffers.cell.size(); ++i) {
    if (!bodies.hit(i) || (buffers.hit(i) && buffers.distance[i] <= bodies.distance[i])) continue;
    buffers.cell[i] = kNoCell;
    buffers.degree[i] = buffers.depth[i] = buffers.crack[i] = 0;
    buffers.value[i] = 0;
    buffers.body[i] = bodies.body[i];
    buffers.normal[i] = bodies.normal[i];
    buffers.distance[i] = bodies.distance[i];
  }
}

Camera startingBefore(const Box& box, const Camera& camera) {
  if (camera.projection == Projection::perspective || box.isEmpty()) return camera;
  constexpr double kMargin = 0.01;  // distance from the rays' start to the box, in diagonals of the box
  const double half = 0.5 * box.sizes().dot(camera.forward.cwiseAbs());
  const double nearest = (box.center() - camera.eye).dot(camera.forward) - half - kMargin * box.diagonal().norm();
  Camera moved = camera;
  if (nearest < 0) moved.eye += nearest * camera.forward;
  return moved;
}

}  // namespace hpsdf::render
