#pragma once
// Lookup, evaluation and ray tracing of a field in grid coordinates, in double precision. Lookup and evaluation repeat
// what core has, on purpose: this is the oracle, tested against the field's own queries, and must not share their
// faults. For the same reason it does without the short cuts of the shaders: every ray starts where it enters the
// domain, and what `NodeBounds` say is asked for less.

#include <optional>
#include <vector>

#include "hpsdf/field.h"
#include "view/blend_zone_bounds.h"
#include "view/grid_space.h"
#include "view/surface_bounds.h"

namespace hpsdf::render {

/// A node that holds a point.
struct CellPoint {
  std::uint32_t node;
  int depth;
  Vector3 base;      ///< lower corner of the base cell, grid coordinates
  Vector3 path;      ///< lower corner of the node within its base cell, counted in nodes of its depth
  Vector3 fraction;  ///< of the point within the node, in [0, 1]
};

struct Sample {
  double value;
  Vector3 gradient;  ///< with respect to local coordinates
};

/// A part of a ray: point(t) = origin + t · direction, t from 0 to `length`.
struct Ray {
  Vector3 origin;     ///< grid coordinates, within the domain
  Vector3 direction;  ///< grid coordinates per world unit
  double length;      ///< world units, up to where it leaves the domain
};

struct Hit {
  double t;
  CellPoint cell;
  Vector3 local;  ///< coordinates within the cell, in [-1, 1] but for rounding
  bool onFace;    ///< the offset is crossed from one leaf to the next, not within one
};

/// A hit on a face is a crack where |f − offset| exceeds this, in domain diagonals times the slope there (at least 1,
/// that of a distance). The march looks into a leaf 1.4e-6 past its face at most, so that it meets a zero that lies
/// just behind the face of a continuous field there as well, with as little height; single precision adds 2e-7. As in
/// the shaders.
constexpr double kCrack = 4e-6;

/// A field made ready for tracing. Keeps a reference to the field.
class TraceField {
 public:
  explicit TraceField(const Field& field);

  const GridSpace& space() const { return space_; }

  /// The leaf that holds a point given in grid coordinates.
  CellPoint leafAt(const Vector3& p) const;

  /// At local coordinates of a leaf, which may lie a little outside of it.
  Sample sample(const CellPoint& leaf, const Vector3& local) const;
  double value(const CellPoint& leaf, const Vector3& local) const;

  int degree(std::uint32_t leaf) const { return node::degree(field_.nodes[leaf]); }

  /// World gradient from one in local coordinates of a cell.
  Vector3 worldGradient(const Vector3& local, int depth) const;

  /// The first crossing of f = offset (docs/rendering.md, "Tracing").
  std::optional<Hit> trace(const Ray& ray, double offset) const;

 private:
  /// Whether others may have a say there: of a blended field alone.
  bool nearFace(const CellPoint& at) const;

  Sample samplePolynomial(std::uint32_t leaf, const Vector3& local) const;
  /// The definition, by all leaves that reach the point.
  Sample sampleBlended(const CellPoint& leaf, const Vector3& local) const;
  template <typename Use>
  void forEachReaching(const Vector3& p, const Use& use) const;

  CellPoint baseCellAt(const Vector3& p) const;
  void descend(CellPoint& at) const;
  /// Down to a leaf, or to a node in whose box the field cannot reach `offset`.
  CellPoint relevantNodeAt(const Vector3& p, double offset) const;
  /// Slope of the leaf's linear part along a direction in local coordinates.
  double linearSlope(std::uint32_t leaf, const Vector3& direction) const;
  bool excludes(std::uint32_t node, double offset) const;

  const FieldData& field_;
  const std::vector<std::uint32_t>& reaches_;
  GridSpace space_;
  std::vector<ZoneBounds> zones_;
  std::vector<NodeBounds> bounds_;
};

}  // namespace hpsdf::render
