#pragma once
// Enclosures of single leaves.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "field/query/leaves.h"
#include "field/range/enclosure.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/detail/legendre_part.h"
#include "hpsdf/detail/lookup_grid.h"

namespace hpsdf::range {

/// Eight parts of a leaf or of a part of it.
struct PartGroup {
  static constexpr std::int32_t kWhole = -1;

  Parts parts;
  std::array<std::int32_t, 8> groups;  ///< for each part, the index of the group of its own parts, or `kWhole`
};

/// The enclosure of a leaf and, where the leaf is far from linear, of its parts.
struct LeafEnclosure {
  Enclosure whole;
  std::vector<PartGroup> groups;  ///< the first one holds the eighths of the leaf; empty for a leaf without parts
};

/// Returns the reach of the local coordinates of a leaf: the leaf has a weight only where they lie in [−reach, reach]³.
inline double reachOf(const FieldData& field) { return 1 + 2 * field.blend; }

/// The signed distance of an exact leaf around a point.
struct KnownDistance {
  double value = 0;   ///< what the leaf returns at the point
  double offset = 0;  ///< subtracted from every distance (`ExactTriangles::offset`)
  bool isSignUncertain = false;
};

/// Sets the range of an enclosure to what a signed distance can be within `radius` of a point.
void setAround(Enclosure& enclosure, const KnownDistance& known, double radius);

/// Finds enclosures of leaves wherever the leaves have a weight. Thread-safe.
class LeafEnclosures {
 public:
  /// Keeps references to the field and the frame. Leaves without values in `relevant` get wide enclosures at less cost.
  LeafEnclosures(const FieldData& field, const GridFrame& frame, const std::optional<Interval>& relevant);

  LeafEnclosure operator()(const query::OctreeNode& leaf) const;

 private:
  struct ExactLeaf;

  LeafEnclosure ofPolynomial(const query::OctreeNode& leaf) const;
  Enclosure ofPart(const std::vector<double>& cube, int degree, int levels, double share, LeafEnclosure& found) const;
  LeafEnclosure ofExact(const query::OctreeNode& leaf) const;
  Enclosure ofExactHalves(const ExactLeaf& leaf, const Vector3& centre, double half, int levels,
                          LeafEnclosure& found) const;
  Enclosure ofExactPart(const ExactLeaf& leaf, const Vector3& centre, double half, int levels,
                        LeafEnclosure& found) const;
  bool isRelevant(double min, double max) const {
    return !relevant_ || (max >= relevant_->min && min <= relevant_->max);
  }
  double share(const query::OctreeNode& leaf) const;
  int levelsOfExact(const query::OctreeNode& leaf) const;

  const FieldData& field_;
  const GridFrame& frame_;
  std::optional<Interval> relevant_;
  double reach_;
  double coordinateNoise_ = 0;  ///< greatest rounding error of the coordinates of a query point
  double farthest_ = 0;         ///< greatest distance between a point of the domain and a vertex
  detail::LegendreRows below_, above_;
};

}  // namespace hpsdf::range
