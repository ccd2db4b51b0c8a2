#pragma once
// How the polynomials of neighbouring leaves pull at each other where they should be continuous: a matrix too large to
// be kept, as products with vectors.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "field/query/leaves.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf {

/// M with xᵀMx = Σ_F w_F ∫_F (f_left − f_right)² dA / |Ω|, w_F being the smaller cell's edge across the face F.
///
/// x holds the coefficients of all leaves in the order of the octree, each times √(V/|Ω|)·‖L_i L_j L_k‖, so that |x|²
/// is the mean of f² over the domain and M has no unit. The face of a large leaf is restricted to that of a small one
/// exactly, by halving it again and again: on a part of a face the trace of degree p is one of degree p.
///
/// Products use TBB where they are called; what they give does not depend on the number of threads.
class FaceCoupling {
 public:
  explicit FaceCoupling(const FieldData& field);

  /// Of a field with these nodes and coefficients in double.
  std::vector<double> toUnknowns(const FieldData& field) const;
  /// The way back. Gives each leaf coefficients of its own, in the order of the octree.
  void fromUnknowns(std::span<const double> x, FieldData& field) const;

  /// out = Mx + weight·x; returns xᵀ·out.
  double apply(double weight, const std::vector<double>& x, std::vector<double>& out);

  /// That of M, or close to it: on hanging faces as if the small ones covered the large one.
  std::vector<double> diagonal() const;

 private:
  /// An interface; its large side may be as small as the other.
  struct Link {
    std::uint32_t small, large;          ///< leaves
    std::array<std::uint32_t, 2> along;  ///< place of the small face in the large one, in small ones
    std::uint8_t axis;
    std::uint8_t levels;  ///< how often the large one is halved
    std::uint8_t side;    ///< of the small leaf: 0 where the face lies at its lower end
  };
  /// Coefficients of one cell onto those of its face, the product of orthonormal polynomials of the face's axes, which
  /// are graded by their total degree: the lower ones come first whatever the cell's degree.
  struct Trace {
    std::vector<std::uint16_t> place;           ///< on the face, by coefficient
    std::array<std::vector<double>, 2> factor;  ///< at the lower and the upper end
  };

  void linkLeaves(const FieldData& field);
  void collectAround();
  void take(const Link& link, std::uint32_t leaf, int side, const double* x, double* face) const;
  void give(const Link& link, std::uint32_t leaf, int side, double scale, const double* face, double* out) const;
  void differ(std::size_t link, const double* x);
  void pull(std::uint32_t leaf, std::size_t link, double* out) const;

  std::vector<Leaf> leaves_;
  std::vector<std::uint8_t> degree_;    ///< by leaf
  std::vector<std::size_t> start_;      ///< of a leaf's unknowns; one more at the end
  std::vector<double> scale_;           ///< √(V/|Ω|), by depth
  std::vector<Link> links_;             ///< in the order of their small leaves
  std::vector<std::size_t> differsAt_;  ///< where the difference across a link lies; one more at the end
  std::vector<std::uint32_t> around_;   ///< links by leaf
  std::vector<std::size_t> aroundAt_;   ///< where a leaf's begin; one more at the end
  std::vector<double> differences_;
  std::array<std::array<Trace, 3>, kMaxDegree + 1> traces_;  ///< of the degrees that occur
};

}  // namespace hpsdf
