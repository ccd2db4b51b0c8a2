#include "compare/comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <span>
#include <utility>

#include "console/long_work.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::size_t kPointsPerCheck = 65536;  // number of points between two checks for cancellation

/// The points of a comparison: uniform ones and ones near the surface.
using PointSets = std::array<ExactSamples, 2>;

/// Returns the narrowest of the bands to which the constructions of the fields were limited, or 0 if none was.
double narrowestBand(const std::vector<CurrentField>& fields) {
  double narrowest = 0;
  for (const CurrentField& other : fields) {
    const double band = other.field.metadata().settings.band;
    if (band > 0) narrowest = narrowest > 0 ? std::min(narrowest, band) : band;
  }
  return narrowest;
}

PointSets drawPoints(const ReferenceSurface& reference, const Box& domain, const CompareOptions& options,
                     const Progress& progress) {
  const std::size_t half = options.points / 2;
  const SampleOptions uniform{.count = options.points - half, .seed = options.seed, .threads = options.threads};
  const SampleOptions near{.count = half, .seed = ~options.seed, .threads = options.threads};
  return {sampleUniform(*reference.distance, domain, options.band, uniform, progress),
          sampleNear(*reference.distance, reference.mesh, domain, options.near, near, progress)};
}

std::array<std::vector<double>, 2> valuesAt(const Field& field, const PointSets& sets, const Progress& progress) {
  std::array<std::vector<double>, 2> values;
  for (std::size_t k = 0; k < sets.size(); ++k) {
    const std::span<const Vector3> points = sets[k].points;
    values[k].resize(points.size());
    for (std::size_t first = 0; first < points.size(); first += kPointsPerCheck) {
      progress.throwIfCancelled();
      const std::size_t count = std::min(kPointsPerCheck, points.size() - first);
      field.values(points.subspan(first, count), std::span(values[k]).subspan(first, count));
    }
  }
  return values;
}

/// Calls visit(point, Φ, f) for all points of both kinds.
template <typename Visit>
void forEachPoint(const PointSets& sets, const std::array<std::vector<double>, 2>& values, const Visit& visit) {
  for (std::size_t k = 0; k < sets.size(); ++k)
    for (std::size_t n = 0; n < values[k].size(); ++n) visit(sets[k].points[n], sets[k].distances[n], values[k][n]);
}

/// Returns the errors by distance from the surface, in ranges of a quarter of a power of ten. Ranges with too few
/// points for a meaningful figure are left out.
std::vector<ErrorBin> binsOf(const PointSets& sets, const std::array<std::vector<double>, 2>& values) {
  constexpr int kBinsPerDecade = 4;
  constexpr std::size_t kFewestPoints = 50;
  struct Sum {
    std::size_t points = 0;
    double squares = 0, max = 0;
  };
  std::map<int, Sum> sums;
  forEachPoint(sets, values, [&](const Vector3&, double exact, double value) {
    if (exact == 0) return;
    Sum& sum = sums[int(std::floor(kBinsPerDecade * std::log10(std::abs(exact))))];
    const double error = std::abs(value - exact);
    ++sum.points;
    sum.squares += error * error;
    sum.max = std::max(sum.max, error);
  });
  std::vector<ErrorBin> bins;
  for (const auto& [bin, sum] : sums)
    if (sum.points >= kFewestPoints)
      bins.push_back({std::pow(10, double(bin) / kBinsPerDecade), std::pow(10, double(bin + 1) / kBinsPerDecade),
                      sum.points, std::sqrt(sum.squares / double(sum.points)), sum.max});
  return bins;
}

/// A point with a great error, and the cell of the field in which it lies.
struct WorstOfCell {
  double error;
  std::size_t set, index;
  std::uint32_t cell;
};

/// Adds a point to the greatest errors of different cells, of which `worst` keeps `count`, the greatest first. Of equal
/// errors the one that was added first stays first.
void keepIfWorst(std::vector<WorstOfCell>& worst, std::size_t count, const WorstOfCell& point) {
  const auto ofCell = std::ranges::find(worst, point.cell, &WorstOfCell::cell);
  if (ofCell != worst.end()) {
    if (ofCell->error >= point.error) return;
    worst.erase(ofCell);
  }
  worst.insert(std::ranges::upper_bound(worst, point.error, std::greater(), &WorstOfCell::error), point);
  if (worst.size() > count) worst.pop_back();
}

/// Returns the points with the greatest errors, the greatest first, at most one of each cell.
std::vector<WorstPlace> worstPlaces(std::size_t number, const std::vector<CurrentField>& fields, const PointSets& sets,
                                    const std::array<std::vector<double>, 2>& values, std::size_t count,
                                    const Progress& progress) {
  std::vector<WorstOfCell> worst;
  for (std::size_t k = 0; k < sets.size(); ++k)
    for (std::size_t n = 0; n < values[k].size(); ++n) {
      if (n % kPointsPerCheck == 0) progress.throwIfCancelled();
      const double error = std::abs(values[k][n] - sets[k].distances[n]);
      const bool mayCount = worst.size() < count || (count > 0 && error > worst.back().error);
      if (mayCount) keepIfWorst(worst, count, {error, k, n, fields[number].field.cellAt(sets[k].points[n]).id});
    }
  std::vector<WorstPlace> places;
  for (const WorstOfCell& found : worst) {
    const Vector3& point = sets[found.set].points[found.index];
    WorstPlace place{number, point, sets[found.set].distances[found.index], {}};
    for (const CurrentField& other : fields) place.values.push_back(other.field.value(point));
    places.push_back(std::move(place));
  }
  return places;
}

FieldFigures figuresOf(std::size_t number, const CurrentField& current, const PointSets& sets,
                       const std::array<std::vector<double>, 2>& values, int threads, const Progress& progress) {
  FieldFigures figures{.letter = std::string(1, char('A' + number)),
                       .file = printable(current.name),
                       .fileBytes = current.fileBytes.value_or(0),
                       .counts = statistics(current.field)};
  figures.near = measureError(values[1], sets[1].distances, threads);
  progress.throwIfCancelled();
  figures.domain = measureError(values[0], sets[0].distances, threads);
  progress.throwIfCancelled();
  figures.bins = binsOf(sets, values);
  progress.throwIfCancelled();
  forEachPoint(sets, values, [&](const Vector3&, double exact, double value) {
    if (!(value < 0 && exact > 0) && !(value > 0 && exact < 0)) return;
    ++figures.wrongSigns;
    figures.farthestWrongSign = std::max(figures.farthestWrongSign, std::abs(exact));
  });
  return figures;
}

}  // namespace

Box commonDomain(const std::vector<CurrentField>& fields) {
  Box domain = fields.front().field.domain();
  for (const CurrentField& other : fields) {
    const Box box = other.field.domain();
    domain = domain.intersection(box);
    if (domain.isEmpty() || !(domain.sizes().minCoeff() > 0))
      throw Error(other.name + ": its domain does not overlap those of the other fields");
  }
  return domain;
}

double ErrorBin::middle() const { return std::sqrt(from * to); }

FieldComparison compareFields(const Console& console, const std::vector<CurrentField>& fields,
                              const ReferenceSurface& reference, const CompareOptions& options) {
  const bool isNormalized = !fields.front().field.metadata().source.normalization.isIdentity();
  FieldComparison result;
  result.unit = isNormalized ? "normalized units" : "mesh units";
  result.domain = commonDomain(fields);
  result.options = options;
  CompareOptions& used = result.options;
  if (used.band == 0) used.band = narrowestBand(fields);
  if (used.near == 0) used.near = 0.01 * boundingBox(reference.mesh).sizes().maxCoeff();
  if (used.band > 0) used.near = std::min(used.near, used.band);
  return withProgress(console, [&](const Progress& progress) {
    const PointSets sets = drawPoints(reference, result.domain, used, progress);
    for (std::size_t n = 0; n < fields.size(); ++n) {
      progress.update("comparing", double(n) / double(fields.size()));
      const auto values = valuesAt(fields[n].field, sets, progress);
      result.fields.push_back(figuresOf(n, fields[n], sets, values, used.threads, progress));
      progress.throwIfCancelled();
      result.fields.back().tornShare =
          tornShare(fields[n].field, reference.mesh,
                    {.count = std::max<std::size_t>(1, used.points / 2), .seed = used.seed, .threads = used.threads});
      for (WorstPlace& place : worstPlaces(n, fields, sets, values, used.worst, progress))
        result.worst.push_back(std::move(place));
    }
    if (used.times) {
      const std::vector<QueryTimes> times = queryTimes(fields, result.domain, used.seed, progress);
      for (std::size_t n = 0; n < fields.size(); ++n) result.fields[n].times = times[n];
    }
    return result;
  });
}

}  // namespace hpsdf::app
