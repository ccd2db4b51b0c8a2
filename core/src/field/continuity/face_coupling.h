#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "field/query/leaves.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf::continuity {

/// Multiplies vectors by a matrix M that measures the jumps of a field between leaves. M is too large to be stored. It
/// is defined by xᵀMx = Σ_F w_F ∫_F (f_left − f_right)² dA / |Ω|, where F runs over the faces between leaves, w_F is
/// the edge length of the smaller leaf perpendicular to F, and |Ω| is the volume of the domain (Koschier et al. 2017).
///
/// The vector x holds the coefficients of all leaves in octree order. Each coefficient is multiplied by √(V/|Ω|), with
/// the leaf's volume V, and by the norm of the coefficient's Legendre basis function. Hence |x|² is the mean of f² over
/// the domain, and M has no unit. Where leaves of different sizes meet, the larger leaf's polynomial on the face is
/// restricted to the smaller face by repeated halving. This is exact, because the restriction does not raise the
/// degree.
///
/// Some leaves are fixed: exact leaves, which have no coefficients in x, and the linear polynomials that take their
/// place where the surface is plane. A face between a polynomial p and a fixed leaf e contributes w_F ∫_F p² dA / |Ω|
/// to xᵀMx. The rest of w_F ∫_F (p − e)² dA / |Ω| is linear in x or constant; half of the gradient of the linear part,
/// summed over all such faces, is `fixedPart`. Faces between two fixed leaves are left out. Hence half of the gradient
/// of the jumps' energy is Mx + fixedPart.
///
/// The methods run on TBB. Their results do not depend on the number of threads.
class FaceCoupling {
 public:
  /// The coefficients of the field must be double.
  explicit FaceCoupling(const FieldData& field);

  /// Returns the vector x of scaled coefficients of a field. The field must have the same octree as the field
  /// given to the constructor, and its coefficients must be double.
  std::vector<double> toUnknowns(const FieldData& field) const;
  /// Sets the coefficients of a field from the vector x. The field then stores the coefficients of its leaves in octree
  /// order, like x.
  void fromUnknowns(std::span<const double> x, FieldData& field) const;

  /// Computes out = Mx + weight·x and returns xᵀ·out.
  double apply(double weight, const std::vector<double>& x, std::vector<double>& out);

  /// Returns the vector by which exact leaves add to half of the gradient of the jumps' energy. It is empty if the
  /// field has no exact leaves next to polynomials.
  const std::vector<double>& fixedPart() const { return fixedPart_; }

  /// Returns the diagonal of M. It is approximate for a leaf with smaller neighbours: each neighbour contributes
  /// a share of the integral over the leaf's whole face.
  std::vector<double> diagonal() const;

 private:
  /// A face between a leaf (`small`) and an equally large or larger leaf (`large`).
  struct Link {
    std::uint32_t small, large;          ///< indices into `leaves_`
    std::array<std::uint32_t, 2> along;  ///< small face's offset within the large leaf's face, in small faces
    std::uint8_t axis;                   ///< axis perpendicular to the face
    std::uint8_t levels;                 ///< difference of the leaves' depths
    std::uint8_t side;                   ///< 0 if the face lies at the small leaf's lower end, 1 at its upper end
  };
  /// The linear map from a leaf's coefficients to the coefficients of its polynomial on one of its faces. The
  /// basis on the face consists of products of orthonormal Legendre polynomials, sorted by total degree, so that
  /// a polynomial of lower degree uses only the first coefficients.
  struct Trace {
    std::vector<std::uint16_t> faceIndex;       ///< by leaf coefficient: the face coefficient to which it contributes
    std::array<std::vector<double>, 2> factor;  ///< by leaf coefficient: its factor on the lower and the upper face
  };
  struct FaceSamples;

  void makeTraces();
  void linkLeaves(const FieldData& field);
  void groupLinksByLeaf();
  void restrictToFace(const Link& link, std::uint32_t leaf, int side, const double* x, double* face) const;
  void addFromFace(const Link& link, std::uint32_t leaf, int side, double scale, const double* face, double* out) const;
  int faceDegree(const Link& link) const;
  void findFixedPart(const FieldData& field);
  void computeFixedJump(const FieldData& field, std::size_t link, const FaceSamples& samples);
  void addJumps(std::size_t firstLeaf, std::size_t count, std::vector<double>& out) const;
  void computeJump(std::size_t link, const double* x);
  void addJump(std::uint32_t leaf, std::size_t link, double* out) const;

  std::vector<query::OctreeNode> leaves_;
  std::vector<std::uint8_t> degree_;           ///< polynomial degree of each leaf, or `kExactDegree`
  std::vector<std::size_t> start_;             ///< index of each leaf's first entry in x; last, the length of x
  std::vector<double> scale_;                  ///< √(leaf volume V / domain volume |Ω|), by depth in the octree
  std::vector<double> fixedPart_;              ///< see `fixedPart`
  std::vector<char> isFixed_;                  ///< for each leaf, whether it does not change
  std::vector<Link> links_;                    ///< the faces, in the order of their small leaves
  std::vector<double> jumps_;                  ///< face coefficients of the jumps for the x given to `apply` last
  std::vector<std::size_t> jumpStart_;         ///< by link: index of its first entry in `jumps_`; last, `jumps_.size()`
  std::vector<std::uint32_t> linksOfLeaf_;     ///< indices into `links_`, grouped by leaf
  std::vector<std::size_t> linksOfLeafStart_;  ///< by leaf: index of its first entry in `linksOfLeaf_`; last, its size
  std::array<std::array<Trace, 3>, kMaxDegree + 1> traces_;  ///< by degree and axis; empty for degrees that no leaf has
};

}  // namespace hpsdf::continuity
