#pragma once
// Certified ranges: an interval that contains every value of a field in a box.

#include <cstddef>
#include <memory>
#include <optional>

#include "hpsdf/field.h"
#include "hpsdf/types.h"

namespace hpsdf {

namespace range {
class RangeTree;
}

/// The range of a field over a box.
struct FieldRange {
  Interval value;  ///< contains every value that the field returns at points of the box
  /// Contains the exact distance Φ at every point of the box, if the field has bounds (`withBounds`).
  std::optional<Interval> distance;
};

/// Bounds of a field's values in each node of the octree, from which ranges over boxes follow within microseconds.
///
/// The index is made once from a field. It takes about 100 bytes for each leaf, and up to 2 MB more: several times the
/// bytes of a quantized field. Ranges are certified: they allow for all rounding errors, of the field's own queries
/// too. They are not the tightest ones: over boxes of an eighth of the domain's edge, they are typically 20 % wider
/// than the values, and up to twice as wide where leaves are exact or blended. Over small boxes in a leaf with a
/// polynomial they tend to the tightest range of the linear function that touches the polynomial in the middle of the
/// box.
///
/// In an exact leaf, a distance keeps its sign as long as it is not 0. Where the field itself breaks this rule, values
/// with the other sign may be missing: beside the holes of a mesh whose signs were forced to come from its normals, for
/// which no distance is right. Where an exact leaf is blended beyond its box, both signs count if its triangles may
/// lack neighbours there, so that ranges of blended fields with exact leaves are wider.
///
///     const RangeIndex index(field);
///     if (index.range(box).value.min > 0) …  // all of the box is outside
class RangeIndex {
 public:
  /// Keeps a reference to the field, which must outlive the index. The index does not depend on `threads` (0: all that
  /// the machine offers). Throws `Error` if the field has 2^31 nodes or more.
  ///
  /// If only values in the interval `relevant` matter, ranges that hold none of these may be much wider than the
  /// values, and the index is made several times as fast and takes less memory.
  explicit RangeIndex(const Field& field, int threads = 0, const std::optional<Interval>& relevant = {});
  ~RangeIndex();
  RangeIndex(RangeIndex&&) noexcept;
  RangeIndex& operator=(RangeIndex&&) noexcept;

  /// Returns the range of the field over a box, which contains its faces and may be a single point. The box may reach
  /// beyond the domain, where the field is continued (`Field`). Thread-safe and allocation-free. Throws `Error` if the
  /// box is empty or not finite.
  ///
  /// Values in the interval `known` do not matter to the caller: the range is made no tighter than is needed to tell
  /// how far it reaches beyond them, which is several times as fast where it does not. Its ends may be infinite.
  FieldRange range(const Box& box, const std::optional<Interval>& known = {}) const;

  /// Returns the bytes of memory that the index takes besides the field.
  std::size_t bytes() const;

 private:
  std::unique_ptr<const range::RangeTree> tree_;
};

}  // namespace hpsdf
