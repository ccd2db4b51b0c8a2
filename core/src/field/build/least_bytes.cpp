#include "field/build/least_bytes.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace hpsdf::detail {
namespace {

/// A list of so few triangles takes fewer bytes than almost any polynomial.
constexpr std::size_t kFewTriangles = 12;
/// A longer list is not taken. Twice as many triangles would save another third of the bytes of a field, but queries
/// of its longest lists would take more than half a microsecond.
constexpr std::size_t kMostTriangles = 192;

constexpr double kNone = std::numeric_limits<double>::infinity();

}  // namespace

void LeastBytes::consider(CheapCell& cell, Fit&& fit, double bytes, double ratio) const {
  if (bytes >= cell.bytes) return;
  cell.fit = std::move(fit);
  cell.bytes = bytes;
  cell.leafRatio = ratio;
}

/// Returns the bytes of a leaf without error. A triangle is stored once, however many leaves refer to it. Its bytes
/// count in the leaf that contains its first corner.
double LeastBytes::exactBytes(const Fit& fit, const Box& box) const {
  if (!fit.isExact()) return polynomialBytes(fit);
  constexpr double kWord = 4, kTriangle = 12 + 12 / 2.0;  // a closed mesh has half as many vertices as triangles
  const std::vector<std::uint32_t>& list = fit.list.triangles;
  const TriangleSearch& search = exact_->search();
  std::size_t runs = 0, owned = 0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    runs += i == 0 || list[i] != list[i - 1] + 1;
    owned += box.contains(search.vertices()[search.triangles()[list[i]][0]]);
  }
  const std::size_t octantWords = (list.size() + 3) / 4, signWords = fit.sign.rule == ExactSign::winding ? 4 : 0;
  return budget_.nodeBytes() + kWord * double(1 + octantWords + runs + signWords) + kTriangle * double(owned);
}

/// Makes a leaf of a cell that is not divided although no leaf is within the tolerance.
void LeastBytes::makeSmallestLeaf(CheapCell& cell, const Box& box, ToleranceFit&& polynomial) const {
  if (exact_)
    if (std::optional<Fit> fit = exact_->makeExact(box, false).fit) {
      const double bytes = exactBytes(*fit, box);
      return consider(cell, std::move(*fit), bytes);
    }
  if (polynomial.closest.coefficients.empty()) polynomial = fitter_.fit(box, 0);
  cell.isMissed = !polynomial.fit;
  Fit fit = cell.isMissed ? std::move(polynomial.closest) : std::move(*polynomial.fit);
  const double bytes = polynomialBytes(fit);
  consider(cell, std::move(fit), bytes, polynomial.ratio);
}

bool LeastBytes::makeLeaf(CheapCell& cell, const CellPlace& place, double ratioAbove) const {
  constexpr double kSmallestChild = 4;  // coefficients
  const double leastOfChildren = budget_.bytes(8, 8 * kSmallestChild);
  const Box box = tree_.boxOf(place);
  constexpr std::uint64_t kBetweenChecks = 4096;
  if (++cells_ % kBetweenChecks == 0) requireRoom_(cells_);
  cell.bytes = kNone;
  if (exact_) {
    if (std::optional<Fit> fit = exact_->fitOfFarCell(box, kFewTriangles)) {
      cell.bytes = exactBytes(*fit, box);
      cell.fit = std::move(*fit);
      return false;
    }
  }
  ToleranceFit polynomial = fitter_.fit(box, ratioAbove);
  cell.ratio = polynomial.ratio;
  if (polynomial.fit) {
    const double bytes = polynomialBytes(*polynomial.fit);
    consider(cell, std::move(*polynomial.fit), bytes, polynomial.ratio);
  }
  constexpr int kCheapDegree = 2;  // a longer list than those above does not take fewer bytes
  if (exact_ && (!polynomial.fit || cell.fit.degree > kCheapDegree)) {
    if (std::optional<Fit> fit = exact_->fitOfFarCell(box, kMostTriangles)) {
      const double bytes = exactBytes(*fit, box);
      consider(cell, std::move(*fit), bytes);
    }
  }
  if (cell.bytes <= leastOfChildren) return false;

  // Where the distance jumps, no polynomial is within the tolerance. Cells that are hardly larger than the tolerance
  // show the place of the jump well enough.
  constexpr double kSmallestAtJump = 4;
  const bool isSmallest = place.depth >= maxDepth_ ||
                          (polynomial.jumps && box.sizes().maxCoeff() < kSmallestAtJump * fitter_.allowed().tolerance);
  if (!isSmallest) return true;
  if (cell.bytes == kNone) makeSmallestLeaf(cell, box, std::move(polynomial));
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
