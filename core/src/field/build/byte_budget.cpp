#include "field/build/byte_budget.h"

#include <algorithm>
#include <cmath>

#include "field/refuse.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf::detail {
namespace {

/// The part of the limit that remains without the lookup grid. The grid has an entry for each base cell or, if that is
/// more, for a sixteenth of the bytes of nodes and coefficients; blending adds half an entry.
double limitWithoutLookup(const BuildOptions& options) {
  if (!options.maxBytes) return HUGE_VAL;
  const auto limit = double(*options.maxBytes);
  const double entries = options.blend > 0 ? 1.5 : 1;
  const double baseEntries = 8.0 * double(std::size_t(options.grid[0]) * options.grid[1] * options.grid[2]);
  return std::min(limit / (1 + entries / 16), limit - entries * baseEntries);
}

}  // namespace

ByteBudget::ByteBudget(const BuildOptions& options)
    : options_(options),
      coefficientBytes_(options.coefficients == CoefficientType::float64 ? sizeof(double) : sizeof(float)),
      limit_(limitWithoutLookup(options)) {}

bool ByteBudget::isAskedFor(const BuildOptions& options) { return options.maxBytes.has_value(); }

int ByteBudget::finalDegree(int degree) const {
  return options_.enrich ? std::max(degree, std::min(degree + 1, options_.maxDegree)) : degree;
}

std::size_t ByteBudget::finalCoefficients(int degree) const {
  return std::size_t(coefficientCount(finalDegree(degree)));
}

double ByteBudget::nodeBytes() const {
  return 8 + (options_.blend > 0 ? 4 : 0) + (options_.bounds ? double(sizeof(CellBound)) : 0);
}

double ByteBudget::leafBytes(int degree) const { return bytes(1, double(finalCoefficients(degree))); }

double ByteBudget::growthLimit() const {
  // Pruning needs refinements to choose from. The factor was measured like `kGrowth` in growth.cpp.
  constexpr double kByteGrowth = 1.6;
  return options_.criterion == Criterion::optimal ? limit_ * kByteGrowth : limit_;
}

void ByteBudget::requireRoomForBaseGrid(double bytes, double leastBytes) const {
  if (leastBytes > limit_ || bytes > growthLimit())
    refuse("the base grid alone takes more than ", *options_.maxBytes, " bytes: allow more, or take a coarser grid");
}

CoefficientType ByteBudget::coefficientType() const {
  const bool isFree = options_.coefficients == CoefficientType::automatic;
  return isFree && options_.maxBytes ? CoefficientType::float32 : options_.coefficients;
}

}  // namespace hpsdf::detail
