#pragma once
// Search for the triangles of a surface that can be nearest to the points of a box.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hpsdf/detail/exact_triangles.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// Triangles that can be nearest to points of a box.
struct TriangleList {
  std::vector<std::uint32_t> triangles;  ///< indices in ascending order
  /// For each triangle, the octants of the box in which it can be nearest, as in `ExactTriangles`.
  std::vector<std::uint8_t> octants;
};

/// A search for the triangles that can be nearest to the points of a box. A signed distance that is measured to
/// triangles offers such a search, from which the construction of a field makes exact leaves. Thread-safe.
class TriangleSearch {
 public:
  virtual ~TriangleSearch() = default;

  virtual std::span<const Vector3> vertices() const = 0;
  /// Returns the triangles, three indices into `vertices()` each. Triangles that are close in space are close in this
  /// list.
  virtual std::span<const std::array<std::uint32_t, 3>> triangles() const = 0;

  /// Returns the length that is subtracted from every unsigned distance: half of the thickness of a shell, else 0.
  virtual double offset() const = 0;

  /// Returns true if the surface may come closer than `distance` to a point of the box. The answer is false only if
  /// this is certain not to happen.
  virtual bool comesWithin(const Box& box, double distance) const = 0;

  /// Returns triangles among which are all triangles that can be nearest to a point of the box. Returns std::nullopt if
  /// more than `most` triangles are found.
  virtual std::optional<TriangleList> nearestTo(const Box& box, std::size_t most) const = 0;

  /// Returns false if `signIn` finds no sign anywhere.
  virtual bool hasSigns() const = 0;

  /// Returns how the sign of the distance follows from the given triangles, which `nearestTo` found for the box.
  /// Returns std::nullopt if the sign cannot be found from them.
  virtual std::optional<LeafSign> signIn(const Box& box, std::span<const std::uint32_t> triangles) const = 0;
};

}  // namespace hpsdf
