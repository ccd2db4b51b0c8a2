#pragma once
// Lookup, evaluation and ray tracing of a field in grid coordinates, in double precision. This code is the
// reference for the shaders, and is itself tested against the queries of `Field`. Lookup and evaluation repeat
// the code of core on purpose, so that they do not share its faults. For the same reason the march takes none
// of the shaders' short cuts: every ray starts where it enters the domain, and fewer bounds decide the steps of
// a ray.

#include <optional>
#include <vector>

#include "hpsdf/field.h"
#include "view/blend_zone_bounds.h"
#include "view/grid_space.h"
#include "view/surface_bounds.h"

namespace hpsdf::render {

/// A node and a point in it.
struct CellPoint {
  std::uint32_t node;
  int depth;
  Vector3 base;      ///< lower corner of the base cell, grid coordinates
  Vector3 path;      ///< lower corner of the node within its base cell, counted in nodes of its depth
  Vector3 fraction;  ///< position of the point within the node, in [0, 1]³
};

struct Sample {
  double value;
  Vector3 gradient;  ///< gradient with respect to local coordinates
};

/// The part of a ray within the domain: point(t) = origin + t · direction, with t from 0 to `length`.
struct Ray {
  Vector3 origin;     ///< grid coordinates, within the domain
  Vector3 direction;  ///< grid coordinates per world unit
  double length;      ///< distance to the exit from the domain, world units
};

struct Hit {
  double t;
  CellPoint cell;
  Vector3 local;  ///< coordinates within the cell, in [−1, 1]³ but for rounding
  bool onFace;    ///< whether f crosses the offset from one leaf to the next, not within one
};

/// A hit on a face is a crack if |f − offset| exceeds kCrack · domain diagonal · slope. The slope is that of
/// the field at the hit, but at least 1, the slope of a distance. The march enters a leaf up to 1.4e-6
/// diagonals behind its face, so that |f − offset| may be that large even in a continuous field with a zero
/// just behind a face. Single precision adds 2e-7. The shaders use the same value.
constexpr double kCrack = 4e-6;

/// A field, with the data that ray tracing needs. Keeps a reference to the field.
class TraceField {
 public:
  explicit TraceField(const Field& field);

  const GridSpace& space() const { return space_; }

  /// The leaf at a point in grid coordinates.
  CellPoint leafAt(const Vector3& p) const;

  /// Value and gradient of the field at local coordinates of a leaf. The point may lie slightly outside of the
  /// leaf.
  Sample sample(const CellPoint& leaf, const Vector3& local) const;
  double value(const CellPoint& leaf, const Vector3& local) const;

  int degree(std::uint32_t leaf) const { return node::degree(field_.nodes[leaf]); }

  /// Converts a gradient with respect to a cell's local coordinates into one with respect to world coordinates.
  Vector3 worldGradient(const Vector3& local, int depth) const;

  /// The first crossing of f = offset along a ray (docs/rendering.md, "Tracing").
  std::optional<Hit> trace(const Ray& ray, double offset) const;

 private:
  class March;

  /// Returns true if other leaves than the point's own may have a weight at the point.
  bool inBlendZone(const CellPoint& at) const;

  Sample samplePolynomial(std::uint32_t leaf, const Vector3& local) const;
  /// The blended field by its definition: the weighted mean of all leaves with a weight at the point.
  Sample sampleBlended(const CellPoint& leaf, const Vector3& local) const;
  /// The blending weight of a leaf at a point, and the gradient of the weight. The point is given relative to the
  /// leaf's lower corner, in grid coordinates.
  struct Weight {
    double value;
    Vector3 gradient;
  };
  Weight weightAt(std::uint32_t leaf, int depth, const Vector3& fromCorner) const;
  /// Calls use(leaf, depth, local, weight) for each leaf with a weight at the point `p`, which is in grid
  /// coordinates.
  template <typename Use>
  void forEachWeight(const Vector3& p, const Use& use) const;
  /// Calls `use`, as forEachWeight does, for the leaves below a node. `corner` is the lower corner of the node.
  template <typename Use>
  void forEachWeightBelow(std::uint32_t node, int depth, const Vector3& corner, const Vector3& p, const Use& use) const;

  CellPoint baseCellAt(const Vector3& p) const;
  void descend(CellPoint& at) const;
  /// The leaf at a point, or the first node on the descent to the leaf whose range of values excludes `offset`.
  CellPoint relevantNodeAt(const Vector3& p, double offset) const;
  /// The derivative of the linear part of a leaf's polynomial along a direction in local coordinates.
  double linearSlope(std::uint32_t leaf, const Vector3& direction) const;
  bool excludes(std::uint32_t node, double offset) const;

  const FieldData& field_;
  const std::vector<std::uint32_t>& blendExtents_;
  GridSpace space_;
  std::vector<BlendZoneBounds> zones_;
  std::vector<SurfaceBounds> bounds_;
};

}  // namespace hpsdf::render
