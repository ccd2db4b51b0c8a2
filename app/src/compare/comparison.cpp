#include "compare/comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <tuple>
#include <utility>

#include "console/long_work.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

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
  constexpr std::size_t kPointsPerCheck = 65536;
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

/// Returns the points with the greatest errors, the greatest first, at most one of each cell.
std::vector<WorstPlace> worstPlaces(std::size_t number, const std::vector<CurrentField>& fields, const PointSets& sets,
                                    const std::array<std::vector<double>, 2>& values, std::size_t count) {
  struct Candidate {
    double error, exact;
    std::size_t set, index;
  };
  std::vector<Candidate> candidates;
  for (std::size_t k = 0; k < sets.size(); ++k)
    for (std::size_t n = 0; n < values[k].size(); ++n)
      candidates.push_back({std::abs(values[k][n] - sets[k].distances[n]), sets[k].distances[n], k, n});
  std::ranges::sort(candidates, [](const Candidate& a, const Candidate& b) {
    return std::tuple(b.error, a.set, a.index) < std::tuple(a.error, b.set, b.index);
  });
  std::vector<WorstPlace> worst;
  std::set<std::uint32_t> seen;
  for (const Candidate& candidate : candidates) {
    if (worst.size() == count) break;
    const Vector3& point = sets[candidate.set].points[candidate.index];
    if (!seen.insert(fields[number].field.cellAt(point).id).second) continue;
    WorstPlace place{number, point, candidate.exact, {}};
    for (const CurrentField& other : fields) place.values.push_back(other.field.value(point));
    worst.push_back(std::move(place));
  }
  return worst;
}

FieldFigures figuresOf(std::size_t number, const CurrentField& current, const PointSets& sets,
                       const std::array<std::vector<double>, 2>& values, int threads) {
  FieldFigures figures{.letter = std::string(1, char('A' + number)),
                       .file = printable(current.name),
                       .fileBytes = current.fileBytes.value_or(0),
                       .counts = statistics(current.field),
                       .near = measureError(values[1], sets[1].distances, threads),
                       .domain = measureError(values[0], sets[0].distances, threads),
                       .bins = binsOf(sets, values)};
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
      result.fields.push_back(figuresOf(n, fields[n], sets, values, used.threads));
      result.fields.back().tornShare =
          tornShare(fields[n].field, reference.mesh,
                    {.count = std::max<std::size_t>(1, used.points / 2), .seed = used.seed, .threads = used.threads});
      for (WorstPlace& place : worstPlaces(n, fields, sets, values, used.worst))
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
