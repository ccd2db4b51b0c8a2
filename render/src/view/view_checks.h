#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Throws `Error`, which names the vector as `name`, for a vector that is not finite.
void checkFinite(const Vector3& vector, const char* name);

/// Throws `Error` for a size out of range, a camera that is not finite or a forward vector that is zero.
void checkCamera(const Camera& camera, int width, int height);

/// Throws `Error` for a clipping plane whose offset is not finite.
void checkClip(const std::optional<ClipPlane>& clip);

/// Throws `Error` for a surface's offset that is not finite.
void checkOffset(double offset);

/// Throws `Error` for a choice of pixels that is neither empty nor as large as the view.
void checkChosen(std::span<const std::uint8_t> chosen, int width, int height);

}  // namespace hpsdf::render
