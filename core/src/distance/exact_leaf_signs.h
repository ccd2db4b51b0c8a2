#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "bvh/hierarchy.h"
#include "hpsdf/detail/exact_triangles.h"
#include "hpsdf/distance_function.h"
#include "sign/pseudonormals.h"
#include "sign/winding_sign.h"

namespace hpsdf::distance {

/// Distance between two triangles below which their distances from a point may round to the same number. It holds for a
/// mesh that is scaled to coordinates of about 1.
constexpr double kTooNear = 0x1p-44;

/// Finds how the distance in an exact leaf gets its sign, such that it has the sign of the whole mesh's inside test.
/// Thread-safe.
///
/// For `InsideTest::winding`, the leaf must be so far from the mesh's holes that the triangles are nearer than any
/// surface that closes a hole. The side (inside or outside) is then constant where no triangle is crossed. In that case
/// the sign of a leaf into which no triangle reaches is that of its centre. In other leaves, the pseudonormal gives the
/// sign if every listed triangle has the outside in front of it and the inside behind it, intersects no other triangle,
/// and has no edge or vertex that is too sharp: the triangles are then the whole boundary of the inside around their
/// nearest points. Elsewhere, the winding number is found at one point of the leaf, from where it can be followed to
/// any other point: every triangle that is crossed on the way is listed, because it is nearest to the point where it is
/// crossed.
class ExactLeafSigns {
 public:
  /// Keeps references to the arguments.
  ExactLeafSigns(const bvh::Hierarchy& hierarchy, InsideTest insideTest, const sign::WindingSign& winding)
      : hierarchy_(hierarchy), insideTest_(insideTest), winding_(winding) {}

  /// Returns false if no leaf has a sign: for outer hulls.
  bool any() const;

  /// Returns the sign in a leaf that has a weight in `box`. `isCrossed` says whether a triangle may reach into the box;
  /// it is called only where the sign depends on it. `slots` are the triangles that can be nearest to points of the
  /// box. Returns std::nullopt if the sign does not follow from these.
  std::optional<LeafSign> find(const Box& box, const std::function<bool()>& isCrossed,
                               std::span<const std::uint32_t> slots) const;

 private:
  using Sides = sign::WindingSign::Sides;

  void prepare() const;
  bool isFarFromHoles(const Box& box) const;
  double leastFromTriangles() const;
  std::optional<WindingReference> referenceIn(const Box& box) const;
  Sides sidesOf(std::uint32_t slot) const;

  const bvh::Hierarchy& hierarchy_;
  InsideTest insideTest_;
  const sign::WindingSign& winding_;
  // made when the sides of a triangle are asked for the first time
  mutable std::once_flag isPrepared_;
  mutable std::optional<sign::Pseudonormals> normals_;
  mutable std::vector<std::uint8_t> known_;  ///< for each triangle, 1 + its sides, or 0 where they are not found yet
};

}  // namespace hpsdf::distance
