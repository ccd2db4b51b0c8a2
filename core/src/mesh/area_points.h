#pragma once

#include <cstddef>
#include <vector>

#include "hpsdf/detail/random_points.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// Draws random numbers that select items with probabilities in proportion to their sizes, by prefix sums.
class SelectBySize {
 public:
  /// Adds an item of this size, which is at least 0.
  void add(double size) { prefixSums_.push_back((prefixSums_.empty() ? 0 : prefixSums_.back()) + size); }
  void reserve(std::size_t items) { prefixSums_.reserve(items); }

  double total() const { return prefixSums_.empty() ? 0 : prefixSums_.back(); }

  /// Returns the number of a random item. The total size must be above 0.
  std::size_t draw(detail::Random& random) const;

 private:
  std::vector<double> prefixSums_;  ///< total size of each item and all before it
};

/// Draws points on the triangles of a mesh, uniformly by area.
class AreaPoints {
 public:
  /// Keeps a reference to the mesh. Throws `Error` if the mesh has no area.
  explicit AreaPoints(const TriangleMesh& mesh);

  Vector3 draw(detail::Random& random) const;

  /// Draws a point in the same way and moves it along the normal of its triangle by up to `reach` to either side,
  /// uniformly in height.
  Vector3 drawWithin(double reach, detail::Random& random) const;

 private:
  struct Drawn {
    Vector3 point;
    std::size_t triangle;
  };

  Drawn drawOnTriangle(detail::Random& random) const;

  const TriangleMesh& mesh_;
  SelectBySize triangles_;
};

}  // namespace hpsdf::mesh
