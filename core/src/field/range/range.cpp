#include "hpsdf/range.h"

#include <algorithm>
#include <limits>
#include <sstream>
#include <string>

#include "field/query/evaluate.h"
#include "field/range/range_tree.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

[[noreturn]] void refuseBox(const Box& box, const char* problem) {
  const auto corner = [](const Vector3& x) {
    std::ostringstream text;
    text << x.x() << "," << x.y() << "," << x.z();
    return text.str();
  };
  throw Error("the box from " + corner(box.min()) + " to " + corner(box.max()) + problem);
}

void requireBox(const Box& box) {
  if (!box.min().allFinite() || !box.max().allFinite())
    refuseBox(box, " is not finite: all six numbers must be finite");
  if (!(box.min().array() <= box.max().array()).all())
    refuseBox(box, " is empty: the first corner must be the lower one along each axis");
}

/// Widens an interval by what |x − q| adds to it, if |x − q| lies between two numbers.
Interval continued(const Interval& interval, double least, double greatest, bool mayFall) {
  const Interval sum{mayFall ? interval.min - greatest : interval.min + least, interval.max + greatest};
  constexpr double kRounding = 8 * std::numeric_limits<double>::epsilon();
  const double rounding = kRounding * (std::max(std::abs(interval.min), std::abs(interval.max)) + greatest);
  return {sum.min - rounding, sum.max + rounding};
}

}  // namespace

RangeIndex::RangeIndex(const Field& field, int threads, const std::optional<Interval>& relevant)
    : tree_(withThreads(threads, [&] { return std::make_unique<const range::RangeTree>(field, relevant); })) {}
RangeIndex::~RangeIndex() = default;
RangeIndex::RangeIndex(RangeIndex&&) noexcept = default;
RangeIndex& RangeIndex::operator=(RangeIndex&&) noexcept = default;

/// The closest points q of the domain to the points x of a box are those of a box again. The field is f(q) + |x − q|
/// there, and Φ is 1-Lipschitz.
FieldRange RangeIndex::range(const Box& box, const std::optional<Interval>& known) const {
  requireBox(box);
  const GridFrame& frame = tree_->frame();
  const Box closest(query::closestInDomain(frame, box.min()), query::closestInDomain(frame, box.max()));
  const Vector3 below = closest.min() - box.min(), above = box.max() - closest.max();
  const bool isInDomain = below.isZero(0) && above.isZero(0);
  const range::Extent extent = tree_->range(closest, isInDomain ? known : std::nullopt);
  FieldRange range{.value = extent.value, .distance = {}};
  if (tree_->hasBounds()) range.distance = extent.distance;
  if (isInDomain) return range;
  const Vector3 farthest = below.cwiseMax(above).cwiseMax(0);
  const Vector3 nearest = (closest.min() - box.max()).cwiseMax(box.min() - closest.max()).cwiseMax(0);
  const double least = query::length(nearest), greatest = query::length(farthest);
  range.value = continued(range.value, least, greatest, false);
  if (range.distance) range.distance = continued(*range.distance, least, greatest, true);
  return range;
}

std::size_t RangeIndex::bytes() const { return tree_->bytes(); }

}  // namespace hpsdf
