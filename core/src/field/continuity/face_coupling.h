#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "field/query/leaves.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf::continuity {

/// The matrix M with xᵀMx = Σ_F w_F ∫_F (f_left − f_right)² dA / |Ω|, where w_F is the smaller leaf's edge across the
/// face F (Koschier et al. 2017). M is too large to be stored; this class computes products with vectors.
///
/// x holds the coefficients of all leaves in the order of the octree, each times √(V/|Ω|)·‖L_i L_j L_k‖, so that |x|²
/// is the mean of f² over the domain and M has no unit. The trace of a large leaf is restricted to the face of a small
/// one exactly, by repeated halving: on a part of a face the trace of degree p has degree p.
///
/// The methods run on TBB. Their results do not depend on the number of threads.
class FaceCoupling {
 public:
  explicit FaceCoupling(const FieldData& field);

  /// Returns x for a field with the same nodes and with coefficients in double.
  std::vector<double> toUnknowns(const FieldData& field) const;
  /// Sets the coefficients of a field from x, in the order of the octree.
  void fromUnknowns(std::span<const double> x, FieldData& field) const;

  /// Computes out = Mx + weight·x and returns xᵀ·out.
  double apply(double weight, const std::vector<double>& x, std::vector<double>& out);

  /// Returns the diagonal of M; where a large leaf has smaller neighbours, as if these covered its whole face.
  std::vector<double> diagonal() const;

 private:
  /// A face of a small leaf and the leaf across it, which is as large or larger.
  struct Link {
    std::uint32_t small, large;          ///< indices into `leaves_`
    std::array<std::uint32_t, 2> along;  ///< position of the small face in the large one, in small faces
    std::uint8_t axis;                   ///< axis across the face
    std::uint8_t levels;                 ///< difference of the leaves' depths
    std::uint8_t side;                   ///< 0 if the face lies at the small leaf's lower end, 1 at its upper end
  };
  /// The restriction of a leaf's coefficients to those of its face. The latter multiply products of orthonormal
  /// polynomials and are ordered by total degree, so that a lower degree uses the first of them.
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
