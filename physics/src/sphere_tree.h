#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/physics/surface_samples.h"

namespace hpsdf::physics {

/// A hierarchy of bounding spheres, of one point at least.
struct SphereTree {
  std::vector<Sphere> spheres;
  std::vector<std::uint32_t> order;  ///< of the points, by which the spheres count them
};

SphereTree sphereTree(std::span<const Vector3> points);

}  // namespace hpsdf::physics
