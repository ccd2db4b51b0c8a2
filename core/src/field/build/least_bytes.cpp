#include "field/build/least_bytes.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "field/cells/exact_lists.h"
#include "field/query/quantized.h"

namespace hpsdf::detail {
namespace {

/// A list of so few triangles takes fewer bytes than almost any polynomial.
constexpr std::size_t kFewTriangles = 12;
/// A longer list is not taken. Twice as many triangles would save another third of the bytes of a field, but queries
/// of its longest lists would take more than half a microsecond.
constexpr std::size_t kMostTriangles = 192;

constexpr double kNone = std::numeric_limits<double>::infinity();

}  // namespace

void LeastBytes::consider(CheapCell& cell, Fit&& fit, double bytes, double ratio,
                          std::vector<LeafTrial>* trials) const {
  if (trials) trials->push_back({fit.degree, bytes, ratio, fit.list.triangles.size()});
  if (bytes >= cell.bytes) return;
  cell.fit = std::move(fit);
  cell.bytes = bytes;
  cell.leafRatio = ratio;
}

double LeastBytes::polynomialBytes(std::span<const double> coefficients, int degree) const {
  if (!budget_.mayQuantize()) return budget_.bytes(1, double(coefficients.size()));
  const double step = fitter_.quantizationLimits().greatestStep(coefficients, degree);
  return budget_.nodeBytes() + query::quantizedBytes(coefficients, degree, step);
}

/// Returns the bytes of a leaf without error.
double LeastBytes::exactBytes(const Fit& fit, const Box& box) const {
  if (!fit.isExact()) return polynomialBytes(fit);
  const TriangleSearch& search = exact_->search();
  const auto isOwned = [&](std::uint32_t triangle) {
    return box.contains(search.vertices()[search.triangles()[triangle][0]]);
  };
  const auto owned = static_cast<std::size_t>(std::ranges::count_if(fit.list.triangles, isOwned));
  return budget_.nodeBytes() + listBytesOf(packedWords(fit.list, fit.sign), owned);
}

/// Makes a leaf of a cell that is not divided although no leaf is within the tolerance.
void LeastBytes::makeSmallestLeaf(CheapCell& cell, const Box& box, ToleranceFit&& polynomial,
                                  std::vector<LeafTrial>* trials) const {
  if (exact_)
    if (std::optional<Fit> fit = exact_->makeExact(box, false).fit) {
      const double bytes = exactBytes(*fit, box);
      return consider(cell, std::move(*fit), bytes, 0, trials);
    }
  if (polynomial.closest.coefficients.empty()) polynomial = fitter_.fit(box, 0);
  cell.isMissed = !polynomial.fit;
  Fit fit = cell.isMissed ? std::move(polynomial.closest) : std::move(*polynomial.fit);
  const double bytes = polynomialBytes(fit);
  consider(cell, std::move(fit), bytes, polynomial.ratio, trials);
}

bool LeastBytes::makeLeaf(CheapCell& cell, const CellPlace& place, double ratioAbove,
                          std::vector<LeafTrial>* trials) const {
  constexpr double kFewestCoefficients = 4, kFewestQuantizedBytes = 6;
  const double leastOfChildren =
      8 * (budget_.mayQuantize() ? budget_.nodeBytes() + kFewestQuantizedBytes : budget_.bytes(1, kFewestCoefficients));
  const Box box = tree_.boxOf(place);
  constexpr std::uint64_t kBetweenChecks = 4096;
  if (++cells_ % kBetweenChecks == 0) requireRoom_(cells_);
  cell.bytes = kNone;
  if (exact_) {
    if (std::optional<Fit> fit = exact_->fitOfFarCell(box, kFewTriangles)) {
      const double bytes = exactBytes(*fit, box);
      consider(cell, std::move(*fit), bytes, 0, trials);
      return false;
    }
  }
  ToleranceFit polynomial = fitter_.fit(box, ratioAbove);
  cell.ratio = polynomial.ratio;
  cell.jumps = polynomial.jumps;
  if (polynomial.fit) {
    const double bytes = polynomialBytes(*polynomial.fit);
    consider(cell, std::move(*polynomial.fit), bytes, polynomial.ratio, trials);
  } else if (trials && !polynomial.closest.coefficients.empty()) {
    trials->push_back({polynomial.closest.degree, polynomialBytes(polynomial.closest), polynomial.ratio, 0, true});
  }
  constexpr int kCheapDegree = 2;  // a longer list than those above does not take fewer bytes
  if (exact_ && (!polynomial.fit || cell.fit.degree > kCheapDegree)) {
    if (std::optional<Fit> fit = exact_->fitOfFarCell(box, kMostTriangles)) {
      const double bytes = exactBytes(*fit, box);
      consider(cell, std::move(*fit), bytes, 0, trials);
    } else if (trials) {
      trials->push_back({.degree = kExactDegree, .bytes = kNone});
    }
  }
  if (cell.bytes <= leastOfChildren) return false;

  // Where the distance jumps, no polynomial is within the tolerance. Cells that are hardly larger than the tolerance
  // show the place of the jump well enough.
  constexpr double kSmallestAtJump = 4;
  const bool isSmallest = place.depth >= maxDepth_ ||
                          (polynomial.jumps && box.sizes().maxCoeff() < kSmallestAtJump * fitter_.allowed().tolerance);
  if (!isSmallest) return true;
  if (cell.bytes == kNone) makeSmallestLeaf(cell, box, std::move(polynomial), trials);
  return false;
}

void LeastBytes::settle(CheapCell& cell) const {
  double bytes = budget_.nodeBytes();
  for (const CheapCell& child : *cell.children) bytes += child.bytes;
  if (bytes >= cell.bytes) {
    cell.children.reset();
    return;
  }
  cell.fit = {};
  cell.bytes = bytes;
}

void LeastBytes::solve(CheapCell& cell, const CellPlace& place, double ratioAbove) const {
  if (!makeLeaf(cell, place, ratioAbove)) return;
  divide(cell);
  double bytes = budget_.nodeBytes();
  for (std::uint32_t child = 0; child < 8; ++child) {
    CheapCell& part = (*cell.children)[child];
    solve(part, place.child(child), cell.ratio);
    bytes += part.bytes;
    if (bytes < cell.bytes) continue;
    cell.children.reset();  // the leaf takes fewer bytes, whatever the other children take
    return;
  }
  settle(cell);
}

}  // namespace hpsdf::detail
