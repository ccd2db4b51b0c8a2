#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "field/query/leaves.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf::continuity {

/// Computes products of vectors with the matrix M, which is too large to be stored. M is defined by xᵀMx = Σ_F
/// w_F ∫_F (f_left − f_right)² dA / |Ω|, where w_F is the edge of the smaller leaf perpendicular to the face F
/// (Koschier et al. 2017).
///
/// The vector x holds the coefficients of all leaves in the order of the octree, each multiplied by
/// √(V/|Ω|)·‖L_i L_j L_k‖. Hence |x|² is the mean of f² over the domain, and M has no unit. Repeated halving
/// restricts the trace of a large leaf to the face of a small one. This is exact, because on a part of a face a
/// trace of degree p still has degree p.
///
/// The methods run on TBB. Their results do not depend on the number of threads.
class FaceCoupling {
 public:
  explicit FaceCoupling(const FieldData& field);

  /// Returns the vector x of a field. The field has the same nodes as the one given to the constructor, and its
  /// coefficients are double.
  std::vector<double> toUnknowns(const FieldData& field) const;
  /// Sets the coefficients of a field from the vector x, whose order is that of the leaves in the octree.
  void fromUnknowns(std::span<const double> x, FieldData& field) const;

  /// Computes out = Mx + weight·x and returns xᵀ·out.
  double apply(double weight, const std::vector<double>& x, std::vector<double>& out);

  /// Returns the diagonal of M. If a large leaf has smaller neighbours, each of them contributes, as an
  /// approximation, a share of the integral over the leaf's whole face.
  std::vector<double> diagonal() const;

 private:
  /// A face of a small leaf, and the leaf on the other side of the face. The other leaf is equally large or
  /// larger.
  struct Link {
    std::uint32_t small, large;          ///< indices into `leaves_`
    std::array<std::uint32_t, 2> along;  ///< position of the small face in the large one, in small faces
    std::uint8_t axis;                   ///< axis across the face
    std::uint8_t levels;                 ///< difference of the leaves' depths
    std::uint8_t side;                   ///< 0 if the face lies at the small leaf's lower end, 1 at its upper end
  };
  /// The map from a leaf's coefficients to the coefficients on one of its faces. The coefficients on the face
  /// belong to products of orthonormal polynomials and are ordered by total degree, so that a lower degree uses
  /// only the first ones.
  struct Trace {
    std::vector<std::uint16_t> faceIndex;       ///< index of the coefficient on the face, by coefficient
    std::array<std::vector<double>, 2> factor;  ///< factor at the lower and the upper end, by coefficient
  };

  void makeTraces();
  void linkLeaves(const FieldData& field);
  void groupLinksByLeaf();
  void restrictToFace(const Link& link, std::uint32_t leaf, int side, const double* x, double* face) const;
  void addFromFace(const Link& link, std::uint32_t leaf, int side, double scale, const double* face, double* out) const;
  void computeJump(std::size_t link, const double* x);
  void addJump(std::uint32_t leaf, std::size_t link, double* out) const;

  std::vector<query::OctreeNode> leaves_;
  std::vector<std::uint8_t> degree_;           ///< by leaf
  std::vector<std::size_t> start_;             ///< index of a leaf's first unknown, and the number of unknowns
  std::vector<double> scale_;                  ///< √(V/|Ω|) by depth
  std::vector<Link> links_;                    ///< in the order of their small leaves
  std::vector<double> jumps_;                  ///< face coefficients of the jumps of the last x
  std::vector<std::size_t> jumpStart_;         ///< index of a link's first number in `jumps_`, and their number
  std::vector<std::uint32_t> linksOfLeaf_;     ///< links grouped by leaf
  std::vector<std::size_t> linksOfLeafStart_;  ///< index of a leaf's first link in `linksOfLeaf_`, and their number
  std::array<std::array<Trace, 3>, kMaxDegree + 1> traces_;  ///< by degree and axis; empty for unused degrees
};

}  // namespace hpsdf::continuity
