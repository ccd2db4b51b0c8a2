#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>

#include "hpsdf/detail/field_data.h"
#include "hpsdf/detail/lookup_grid.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// The bytes of memory that the parts of a field take.
struct FieldBytes {
  std::size_t nodes = 0;
  std::size_t coefficients = 0;
  std::size_t exactTriangles = 0;  ///< triangles, vertices and lists of the exact leaves
  std::size_t lookupGrid = 0;
  std::size_t bounds = 0;

  std::size_t total() const { return nodes + coefficients + exactTriangles + lookupGrid + bounds; }
};

/// A hierarchical hp-adaptive signed distance field (Koschier, Deul, Bender 2016). Fields are immutable; every query
/// is const, thread-safe and allocation-free.
///
/// Inside the domain the value is the polynomial of the leaf that holds the point or, in an exact leaf, the distance
/// to the nearest of the leaf's triangles. Leaves are half-open, so that every
/// point lies in exactly one leaf. The field jumps slightly from leaf to leaf unless it is blended
/// (`FieldData::blend`). A blended field is f = Σ wₙ fₙ / Σ wₙ over the leaves n that have a weight at the point. Here
/// fₙ is the polynomial of leaf n, continued beyond the box of the leaf, and wₙ is a product of smooth steps across the
/// leaf's faces. Value and gradient of a blended field are continuous throughout the domain. Outside the blended zones
/// along the faces, its values are identical to those without blending.
///
/// Outside the domain the value at x is f(q) + |x − q|, where q is the domain's closest point to x, and the gradient
/// is the gradient of this expression. The value is continuous across the domain's boundary; jumps between leaves at
/// the boundary continue outwards. Even if f is exact, the value is only an upper bound of the distance, and hence no
/// safe step for sphere tracing. At infinite points the value is infinite and the gradient NaN.
///
/// A field that was moved from holds nothing: it may only be destroyed or assigned to. Queries of such a field are
/// undefined, and fail an assertion where assertions are on.
class Field {
 public:
  /// Makes a field from finished arrays. Throws `Error` if the arrays violate the layout that `FieldData` describes.
  explicit Field(FieldData data);

  double value(const Vector3& x) const;
  ValueAndGradient valueAndGradient(const Vector3& x) const;

  /// Returns the value, the gradient and the Hessian at x. Value and gradient equal those of `valueAndGradient` to the
  /// bit. The Hessian H is the second derivative of the very function that `value` evaluates:
  /// * In a leaf with a polynomial, H_ab = s_a s_b Σ c_ijk ∂_a ∂_b (L_i L_j L_k), where s_a is 2 divided by the leaf's
  ///   edge along axis a. A polynomial of degree 1 has the Hessian 0.
  /// * In an exact leaf, H = P / d with the signed distance d to the nearest feature and the projection P onto the
  ///   directions in which it curves. With the gradient n, P = 0 if the feature is a face, I − nnᵀ − eeᵀ if it is an
  ///   edge in the direction e, as on a cylinder, and I − nnᵀ if it is a vertex, as on a sphere. H is unbounded near
  ///   edges and vertices.
  /// * In a blended zone, H has the derivatives of the weights too. With W = Σ wₙ and the mean f = Σ wₙ fₙ / W, it is
  ///   (∇∇(Σ wₙ fₙ) − f ∇∇W − ∇f ∇Wᵀ − ∇W ∇fᵀ) / W.
  /// * Outside the domain, only those second derivatives of the field at q remain whose two axes are not clamped. The
  ///   distance r = |x − q| adds (C − nnᵀ) / r with n = (x − q) / r and the projection C onto the clamped axes.
  ///
  /// Where second derivatives do not exist, H is that of one side: at faces of leaves without blending, which have the
  /// derivatives of the leaf that holds x; at the borders of blended zones; at the boundary of the domain, which has
  /// those of the domain; and where the nearest feature changes. On the surface itself, H is 0 at edges and vertices of
  /// exact leaves. At infinite points H has NaN.
  ValueGradientHessian valueGradientHessian(const Vector3& x) const;

  /// Evaluates the field at many points. The results are those of single queries, but come several times faster. All
  /// spans must have the same length.
  void values(std::span<const Vector3> points, std::span<double> out) const;
  void valuesAndGradients(std::span<const Vector3> points, std::span<ValueAndGradient> out) const;
  void valuesAndGradients(std::span<const Vector3> points, std::span<double> values,
                          std::span<Vector3> gradients) const;

  /// Evaluates the field with its second derivatives at many points, one by one. Both spans must have the same length.
  void valuesGradientsHessians(std::span<const Vector3> points, std::span<ValueGradientHessian> out) const;

  /// Returns the leaf that holds x. For x outside the domain, returns the leaf that holds the domain's closest
  /// point to x.
  Cell cellAt(const Vector3& x) const;

  /// Calls `visit` for every leaf in the order of the octree (base cells first to last, children 0 to 7).
  void forEachCell(const std::function<void(const Cell&)>& visit) const;

  const Box& domain() const { return data_.domain; }
  const std::array<std::uint32_t, 3>& grid() const { return data_.grid; }
  const FieldMetadata& metadata() const { return data_.metadata; }
  /// Returns true if the field's coefficients lie in a mapped file (`Loading::mapped`).
  bool isMapped() const { return hpsdf::isMapped(data_); }
  bool singlePrecision() const { return data_.coefficients.index() == 1; }

  /// Returns the arrays that make up the field, for files, uploads to a GPU and tests.
  const FieldData& data() const& { return data_; }
  /// Moves the arrays out of the field, which then is moved from.
  FieldData data() && { return std::move(data_); }

  /// Returns the grid in which queries start their descent of the octree, for uploads to a GPU and tests.
  const LookupGrid& lookupGrid() const { return lookupGrid_; }

  /// Returns the bytes that each part of the field takes. The coefficients of a mapped field lie in its file.
  FieldBytes bytesOfParts() const;
  /// Returns the bytes that the whole field takes.
  std::size_t bytes() const { return bytesOfParts().total(); }

 private:
  FieldData data_;
  LookupGrid lookupGrid_;
};

/// Statistics of the exact leaves of a field.
struct ExactLeafStatistics {
  std::size_t leaves = 0;
  std::size_t triangles = 0;    ///< triangles that the field stores; the lists of several leaves may refer to one
  std::size_t medianList = 0;   ///< median of the number of triangles in a leaf's list
  std::size_t longestList = 0;  ///< greatest number of triangles in a leaf's list
};

/// Statistics of a field: its sizes and the distribution of its leaves.
struct FieldStatistics {
  std::size_t leaves = 0;
  std::size_t nodes = 0;
  std::size_t coefficients = 0;
  std::size_t bytes = 0;      ///< memory that the field takes (`Field::bytes`)
  ExactLeafStatistics exact;  ///< statistics of the exact leaves, which `leaves` includes
  /// Fraction of the domain's volume, by degree of the leaves. `kExactDegree` stands for exact leaves.
  std::map<int, double> degreeVolume;
  std::map<int, double> depthVolume;  ///< fraction of the domain's volume, by depth of the leaves
  std::map<int, std::size_t> degreeLeaves;
  std::map<int, std::size_t> depthLeaves;
};

FieldStatistics statistics(const Field& field);

/// Returns the precision of a field's coefficients as text: "double", "float" or "quantized".
std::string precisionName(const Field& field);

/// Returns a degree or a depth as text: "exact" for the degree of exact leaves, which is greater than every depth.
std::string levelName(int level);

}  // namespace hpsdf
