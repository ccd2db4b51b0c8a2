#include "hpsdf/physics/surface_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <queue>
#include <string>
#include <utility>

#include "hpsdf/detail/random_points.h"
#include "hpsdf/error.h"

namespace hpsdf::physics {
namespace {

constexpr std::size_t kCandidates = 5;  // random candidates for each sample

struct Candidate {
  Vector3 point;
  std::uint32_t triangle;
};

/// The areas and normals of a mesh's triangles. The constructor checks the mesh.
struct Surface {
  std::vector<double> areasUpTo;  ///< total area of each triangle and all before it
  std::vector<Vector3> normals;

  explicit Surface(const TriangleMesh& mesh) {
    const std::string name = mesh.name.empty() ? "mesh" : mesh.name;
    if (mesh.triangles.empty()) throw Error(name + ": has no triangles to take samples of");
    double area = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      if (std::max({a, b, c}) >= mesh.vertices.size())
        throw Error(name + ": triangle " + std::to_string(t) + " refers to a vertex that does not exist");
      for (const std::uint32_t vertex : mesh.triangles[t])
        if (!mesh.vertices[vertex].allFinite())
          throw Error(name + ": vertex " + std::to_string(vertex) + " is not finite");
      const Vector3 normal = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
      area += normal.norm() / 2;
      areasUpTo.push_back(area);
      normals.push_back(normal.stableNormalized());
    }
    if (!(area > 0) || !std::isfinite(area)) throw Error(name + ": has no finite area to take samples of");
  }

  double area() const { return areasUpTo.back(); }
};

std::size_t countOf(const SampleOptions& options, double area) {
  if (options.count.has_value() == options.spacing.has_value())
    throw Error("samples: give either their count or their spacing");
  if (options.spacing && (!(*options.spacing > 0) || !std::isfinite(*options.spacing)))
    throw Error("samples: the spacing must be a number above 0");
  if (options.count == std::size_t{0}) throw Error("samples: the count must be 1 or more");
  // Compute the count as a double: the quotient of an area and a tiny squared spacing may exceed every
  // integer type.
  const double count =
      options.count ? double(*options.count) : std::max(1.0, std::round(area / *options.spacing / *options.spacing));
  if (!(count <= double(kMaxSamples)))
    throw Error("samples: more than " + std::to_string(kMaxSamples) + " would be taken; give " +
                (options.count ? "a lower count" : "a greater spacing"));
  return static_cast<std::size_t>(count);
}

/// Divides the surface into `count` parts of equal area, in the order of the triangles, and draws one
/// random candidate in each part.
std::vector<Candidate> drawCandidates(const TriangleMesh& mesh, const Surface& surface, std::size_t count,
                                      std::uint64_t seed) {
  std::vector<Candidate> candidates(count);
  std::size_t triangle = 0;
  for (std::size_t i = 0; i < count; ++i) {
    detail::Random random(seed, i);
    const double along = random.unit(), u = random.unit(), v = random.unit();
    const double upTo = (double(i) + along) / double(count) * surface.area();
    while (triangle + 1 < surface.areasUpTo.size() && surface.areasUpTo[triangle] <= upTo) ++triangle;
    const auto& [a, b, c] = mesh.triangles[triangle];
    const double toCorner = std::sqrt(u);
    candidates[i] = {
        (1 - toCorner) * mesh.vertices[a] + toCorner * (1 - v) * mesh.vertices[b] + toCorner * v * mesh.vertices[c],
        static_cast<std::uint32_t>(triangle)};
  }
  return candidates;
}

/// Finds the candidates within a fixed radius of a candidate. Sorts the candidates by the cells of a grid,
/// x fastest. The cells are at least as wide as the radius.
class Neighbours {
 public:
  Neighbours(std::vector<Candidate>& candidates, double radius) : radius_(radius) {
    Box box;
    for (const Candidate& candidate : candidates) box.extend(candidate.point);
    lower_ = box.min();
    cell_ = std::max(radius, box.sizes().maxCoeff() / kMostCells);
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order(candidates.size());
    for (std::size_t i = 0; i < order.size(); ++i)
      order[i] = {keyOf(cellAt(candidates[i].point)), static_cast<std::uint32_t>(i)};
    std::ranges::sort(order);
    std::vector<Candidate> sorted(candidates.size());
    keys_.resize(candidates.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      keys_[i] = order[i].first;
      sorted[i] = candidates[order[i].second];
    }
    candidates = std::move(sorted);
  }

  /// Calls f(other, distance) for all other candidates that are within the radius of candidate `index`.
  template <typename F>
  void forEach(const std::vector<Candidate>& candidates, std::size_t index, const F& f) const {
    const auto [x, y, z] = cellAt(candidates[index].point);
    for (std::uint64_t k = z - std::min<std::uint64_t>(z, 1); k <= z + 1; ++k)
      for (std::uint64_t j = y - std::min<std::uint64_t>(y, 1); j <= y + 1; ++j) {
        const std::uint64_t first = keyOf({x - std::min<std::uint64_t>(x, 1), j, k}), last = keyOf({x + 1, j, k});
        for (auto at = std::ranges::lower_bound(keys_, first); at != keys_.end() && *at <= last; ++at) {
          const auto other = static_cast<std::size_t>(at - keys_.begin());
          const double distance = (candidates[other].point - candidates[index].point).norm();
          if (other != index && distance < radius_) f(other, distance);
        }
      }
  }

 private:
  static constexpr double kMostCells = 0x1p20;  // along an axis, so that three cell indices fit a key of 64 bits

  using CellIndex = std::array<std::uint64_t, 3>;

  CellIndex cellAt(const Vector3& point) const {
    CellIndex cell;
    for (int axis = 0; axis < 3; ++axis) cell[axis] = static_cast<std::uint64_t>((point[axis] - lower_[axis]) / cell_);
    return cell;
  }

  static std::uint64_t keyOf(const CellIndex& cell) { return cell[0] | cell[1] << 21 | cell[2] << 42; }

  double radius_, cell_;
  Vector3 lower_;
  std::vector<std::uint64_t> keys_;
};

/// Removes the candidate with the greatest weight, i.e. with the most and nearest neighbours, again and
/// again until `count` candidates are left. Uses the weights that Yuksel (2015) proposes.
std::vector<Candidate> eliminate(std::vector<Candidate> candidates, const Surface& surface, std::size_t count) {
  const double radius =
      std::sqrt(surface.area() / (2 * std::numbers::sqrt3 * double(count)));  // radius of disks in the densest packing
  const double least = 0.65 * radius * (1 - std::pow(double(count) / double(candidates.size()), 1.5));
  const Neighbours neighbours(candidates, 2 * radius);
  const auto weightBetween = [&](std::size_t a, std::size_t b, double distance) {
    if (surface.normals[candidates[a].triangle].dot(surface.normals[candidates[b].triangle]) < 0) return 0.0;
    const double w = 1 - std::max(distance, 2 * least) / (2 * radius), square = w * w, fourth = square * square;
    return fourth * fourth;
  };
  std::vector<double> weights(candidates.size(), 0.0);
  // The weights of candidates only decrease, so that outdated queue entries are too high. They therefore come to the
  // top of the queue, where they are corrected.
  std::priority_queue<std::pair<double, std::uint32_t>> heaviest;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    neighbours.forEach(candidates, i,
                       [&](std::size_t other, double distance) { weights[i] += weightBetween(i, other, distance); });
    heaviest.emplace(weights[i], static_cast<std::uint32_t>(i));
  }
  std::vector<bool> removed(candidates.size(), false);
  for (std::size_t left = candidates.size(); left > count;) {
    const double weight = heaviest.top().first;
    const std::uint32_t i = heaviest.top().second;
    heaviest.pop();
    if (weight != weights[i]) {
      heaviest.emplace(weights[i], i);
      continue;
    }
    removed[i] = true;
    --left;
    neighbours.forEach(candidates, i, [&](std::size_t other, double distance) {
      if (!removed[other]) weights[other] -= weightBetween(i, other, distance);
    });
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (!removed[i]) candidates[kept++] = candidates[i];
  candidates.resize(kept);
  return candidates;
}

}  // namespace

SurfaceSamples::SurfaceSamples(std::span<const Vector3> points, std::span<const Vector3> normals) {
  if (points.empty()) throw Error("samples: there are none");
  if (points.size() > kMaxSamples) throw Error("samples: there are more than " + std::to_string(kMaxSamples));
  if (points.size() != normals.size()) throw Error("samples: there are not as many normals as points");
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!points[i].allFinite() || !normals[i].allFinite())
      throw Error("samples: number " + std::to_string(i) + " is not finite");
  SphereTree tree = buildSphereTree(points);
  for (const std::uint32_t i : tree.order) {
    points_.push_back(points[i]);
    normals_.push_back(normals[i]);
  }
  spheres_ = std::move(tree.spheres);
}

SurfaceSamples sampleSurface(const TriangleMesh& mesh, const SampleOptions& options) {
  const Surface surface(mesh);
  const std::size_t count = countOf(options, surface.area());
  const std::vector<Candidate> samples =
      eliminate(drawCandidates(mesh, surface, kCandidates * count, options.seed), surface, count);
  std::vector<Vector3> points, normals;
  for (const Candidate& sample : samples) {
    points.push_back(sample.point);
    normals.push_back(surface.normals[sample.triangle]);
  }
  return SurfaceSamples(points, normals);
}

}  // namespace hpsdf::physics
