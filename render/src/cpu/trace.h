#pragma once
// Lookup, evaluation and ray tracing of a field in double precision. Tests compare this code with the shaders and with
// the queries of `Field`. It has its own lookup and evaluation, to share no faults with these queries. Its march is
// simpler than the march of the shaders, to share no faults with them: it uses fewer bounds, and every ray starts where
// it enters the domain.

#include <optional>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/blend_zone_bounds.h"
#include "view/grid_space.h"
#include "view/surface_bounds.h"

namespace hpsdf::render {

/// A point and an octree node that contains it.
struct CellPoint {
  std::uint32_t node;
  int depth;
  Vector3 base;      ///< lower corner of the base cell, grid coordinates
  Vector3 path;      ///< lower corner of the node within its base cell, in units of the node's edge length
  Vector3 fraction;  ///< position of the point within the node, in [0, 1]³
};

struct Sample {
  double value;
  Vector3 gradient;  ///< gradient with respect to local coordinates
};

/// The part of a ray within the domain: point(t) = origin + t · direction, with t from 0 to `length`.
struct Ray {
  Vector3 origin;     ///< grid coordinates, within the domain
  Vector3 direction;  ///< change of the grid coordinates per world unit along the ray
  double length;      ///< distance to the exit from the domain, world units
};

struct Hit {
  double t;
  CellPoint cell;
  Vector3 local;  ///< coordinates within the cell, in [−1, 1]³ but for rounding
  bool onFace;    ///< whether f crosses the offset on the face between two leaves, not within one leaf
  std::optional<std::uint32_t> triangle = {};  ///< the triangle of an exact leaf that the ray crosses
};

/// A hit on the face between two leaves is a crack if |f − offset| exceeds kCrack · domain diagonal · max(|∇f|, 1). In
/// a field without jumps, |f − offset| stays below this threshold: the march enters a leaf at most 1.4e-6 diagonals
/// behind its face, and single precision adds an error of 2e-7 diagonals. The shaders use the same value.
constexpr double kCrack = 4e-6;

/// A field, with the data that ray tracing needs. Keeps a reference to the field.
class TraceField {
 public:
  explicit TraceField(const Field& field);

  const GridSpace& space() const { return space_; }

  /// The leaf at a point in grid coordinates.
  CellPoint leafAt(const Vector3& p) const;

  /// Value and gradient of the field at local coordinates of a leaf; the point may lie slightly outside of the leaf.
  Sample sample(const CellPoint& leaf, const Vector3& local) const;
  double value(const CellPoint& leaf, const Vector3& local) const;

  /// Value and gradient of the field at a hit. Where a ray crosses a triangle, the gradient is the triangle's normal.
  Sample sample(const Hit& hit) const;

  int degree(std::uint32_t leaf) const { return node::degree(field_.nodes[leaf]); }

  /// Converts a gradient with respect to a cell's local coordinates into one with respect to world coordinates.
  Vector3 worldGradient(const Vector3& local, int depth) const;

  /// Makes the bounds of cells that `trace` needs, unless they are there. That reads all coefficients.
  void prepareTracing();

  /// The first crossing of f = offset along a ray (docs/rendering.md, "Tracing"). Needs `prepareTracing`.
  std::optional<Hit> trace(const Ray& ray, double offset) const;

 private:
  class March;

  /// Returns true if leaves other than the one that contains the point may have a blending weight there.
  bool inBlendZone(const CellPoint& at) const;

  /// The function of one leaf, without blending, at the point `p`, in grid coordinates. `local` are the local
  /// coordinates of this point.
  Sample sampleLeaf(std::uint32_t leaf, int depth, const Vector3& local, const Vector3& p) const;
  /// The blended field by its definition: the weighted mean of the functions of all leaves whose blending weights at
  /// the point are above 0.
  Sample sampleBlended(const CellPoint& leaf, const Vector3& local) const;
  /// The blending weight of a leaf at a point, and its gradient in grid coordinates.
  struct Weight {
    double value;
    Vector3 gradient;
  };
  Weight weightAt(std::uint32_t leaf, int depth, const Vector3& fromCorner) const;
  /// Calls use(leaf, depth, local, weight) for each leaf with a blending weight at the point `p`, in grid coordinates.
  template <typename Use>
  void forEachWeight(const Vector3& p, const Use& use) const;
  /// Calls `use`, as forEachWeight does, for the leaves below a node. `corner` is the lower corner of the node.
  template <typename Use>
  void forEachWeightBelow(std::uint32_t node, int depth, const Vector3& corner, const Vector3& p, const Use& use) const;

  CellPoint baseCellAt(const Vector3& p) const;
  void descend(CellPoint& at) const;
  /// Descends to the leaf at a point, but stops earlier at a node whose range of field values excludes `offset`.
  CellPoint relevantNodeAt(const Vector3& p, double offset) const;
  /// The derivative of the linear part of a leaf's polynomial along a direction in local coordinates; 0 for an exact
  /// leaf.
  double linearSlope(std::uint32_t leaf, const Vector3& direction) const;
  bool excludes(std::uint32_t node, double offset) const;
  /// Returns true if f crosses `offset` within a leaf where the triangles of the leaf are, and nowhere else.
  bool crossesAtTriangles(std::uint32_t leaf, double offset) const;
  /// The point at local coordinates of a leaf, in grid coordinates.
  Vector3 gridPoint(const CellPoint& leaf, const Vector3& local) const;
  Vector3 worldPoint(const Vector3& gridPoint) const;
  /// The inverse of worldGradient.
  Vector3 localGradient(const Vector3& world, int depth) const;

  const Field& whole_;
  const FieldData& field_;
  const std::vector<std::uint32_t>& blendExtents_;
  GridSpace space_;
  std::vector<BlendZoneBounds> zones_;
  std::vector<SurfaceBounds> bounds_;
};

}  // namespace hpsdf::render
