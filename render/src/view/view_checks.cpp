#include "view/view_checks.h"

#include <cmath>
#include <string>

#include "hpsdf/error.h"
#include "view/view_size.h"

namespace hpsdf::render {

void checkFinite(const Vector3& vector, const char* name) {
  if (!vector.allFinite()) throw Error(std::string("a view's ") + name + " is not finite: give finite numbers");
}

void checkCamera(const Camera& camera, int width, int height) {
  checkViewSize(width, height);
  checkFinite(camera.eye, "eye");
  checkFinite(camera.forward, "forward vector");
  checkFinite(camera.right, "right vector");
  checkFinite(camera.up, "up vector");
  if (camera.forward.isZero(0)) throw Error("a camera's forward vector is zero: give a direction to look along");
}

void checkClip(const std::optional<ClipPlane>& clip) {
  if (clip && !std::isfinite(clip->offset))
    throw Error("a clipping plane's offset is not finite: give a finite number");
}

void checkOffset(double offset) {
  if (!std::isfinite(offset)) throw Error("the surface's offset is not finite: give a distance in world units");
}

void checkChosen(std::span<const std::uint8_t> chosen, int width, int height) {
  if (chosen.empty() || chosen.size() == std::size_t(width) * std::size_t(height)) return;
  throw Error("the choice of pixels has " + std::to_string(chosen.size()) + " entries for a view of " +
              std::to_string(width) + "x" + std::to_string(height) + " pixels: give one for each pixel, or none");
}

}  // namespace hpsdf::render
