#pragma once
// The polynomial of a cell, or its list of triangles, as a sequence of numbers in a file or a message.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "field/cells/cell_fit.h"
#include "hpsdf/detail/triangle_list.h"

namespace hpsdf::detail {

/// Bits that describe a fit: kFitted and kCached tell whether its polynomial and its cached projection follow;
/// kOutsideBand and kNear tell where the cell lies; kFinal and kExact tell that the cell is without error, and that its
/// triangles follow; kRaisesAtOnce tells that the cell needs no trial of its children.
enum FitBits : std::uint8_t {
  kFitted = 1,
  kOutsideBand = 2,
  kNear = 4,
  kCached = 8,
  kFinal = 16,
  kExact = 32,
  kRaisesAtOnce = 64,
  kAllBits = 127
};

// The functions named …Item and …Items work in both directions. With a `CheckedWriter` or a `MessageWriter` they write
// a fit and do not change it; with a `CheckedReader` or a `MessageReader` they read and check it.

template <typename Stream>
void finiteItem(Stream& stream, auto& value) {
  stream.item(value);
  stream.require(std::isfinite(value), "a number is not finite");
}

template <typename Stream>
void coefficientItems(Stream& stream, int& degree, std::vector<double>& coefficients, int least, int most) {
  auto stored = static_cast<std::uint8_t>(degree);
  stream.item(stored);
  stream.require(stored >= least && stored <= most, "a degree is out of range");
  degree = stored;
  stream.array(coefficients, static_cast<std::uint64_t>(coefficientCount(degree)));
  stream.require(std::ranges::all_of(coefficients, [](double c) { return std::isfinite(c); }),
                 "a number is not finite");
}

/// Limits of the fits of a construction.
struct FitLimits {
  int mostDegree = kMaxDegree;
  std::size_t triangles = triangle_run::kMostTriangles;  ///< number of triangles to which exact leaves can refer
};

template <typename Stream>
void exactItems(Stream& stream, Fit& fit, std::size_t triangles) {
  fit.degree = kExactDegree;
  stream.item(fit.sign.rule);
  stream.require(fit.sign.rule <= ExactSign::winding, "a cell's sign is unknown");
  if (fit.sign.rule == ExactSign::winding) {
    for (double& coordinate : fit.sign.reference.point) finiteItem(stream, coordinate);
    stream.item(fit.sign.reference.winding);
  }
  finiteItem(stream, fit.error.volume);
  auto& [listed, octants] = fit.list;
  stream.list(listed);
  const bool ascends = std::ranges::adjacent_find(listed, std::greater_equal()) == listed.end();
  stream.require(!listed.empty() && ascends && listed.back() < triangles, "an exact cell has triangles that cannot be");
  stream.array(octants, listed.size());
  stream.require(std::ranges::find(octants, 0) == octants.end(), "a triangle of an exact cell is in no octant");
}

template <typename Stream>
void fitItems(Stream& stream, Fit& fit, const FitLimits& limits) {
  const auto bit = [](bool set, std::uint8_t value) { return set ? value : std::uint8_t{0}; };
  auto parts = static_cast<std::uint8_t>(bit(!fit.coefficients.empty(), kFitted) | bit(fit.outsideBand, kOutsideBand) |
                                         bit(fit.error.near, kNear) | bit(!fit.cached.coefficients.empty(), kCached) |
                                         bit(fit.isFinal, kFinal) | bit(fit.isExact(), kExact) |
                                         bit(fit.raisesAtOnce, kRaisesAtOnce));
  stream.item(parts);
  stream.require(parts <= kAllBits, "a cell's bits are unknown");
  stream.require((parts & kExact) == 0 || (parts & (kFitted | kCached | kFinal)) == kFinal,
                 "an exact cell is not without error");
  fit.outsideBand = (parts & kOutsideBand) != 0;
  fit.error.near = (parts & kNear) != 0;
  fit.isFinal = (parts & kFinal) != 0;
  fit.raisesAtOnce = (parts & kRaisesAtOnce) != 0;
  if ((parts & kExact) != 0) exactItems(stream, fit, limits.triangles);
  if ((parts & kFitted) != 0) {
    finiteItem(stream, fit.error.weighted);
    finiteItem(stream, fit.error.squared);
    finiteItem(stream, fit.error.volume);
    coefficientItems(stream, fit.degree, fit.coefficients, 1, limits.mostDegree);
  }
  if ((parts & kCached) != 0) {
    finiteItem(stream, fit.cached.meanSquare);
    coefficientItems(stream, fit.cached.degree, fit.cached.coefficients, fit.degree, kMaxDegree + 1);
  }
}

}  // namespace hpsdf::detail
